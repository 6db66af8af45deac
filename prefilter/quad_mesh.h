// SPDX-License-Identifier: Apache-2.0
// Quads and triangles over shared vertices, which may merge: the topology that face loops run through.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/index.h"
#include "base/vec.h"
#include "prefilter/vertex_stars.h"

namespace farfield {

/// Corners of a quad in order, cut into the triangles (0, 1, 2) and (2, 3, 0); or of a triangle, and kNoIndex.
using PolygonCorners = uvec4;

inline int corner_count(const PolygonCorners& face) { return face.w == kNoIndex ? 3 : 4; }

/// Half 0 or 1 of a quad, or half 0 of a triangle: itself.
inline uvec3 half_of(const PolygonCorners& face, int half) {
  return half == 0 ? uvec3(face.x, face.y, face.z) : uvec3(face.z, face.w, face.x);
}
/// Calls visit(half, its corners) for the halves of a quad, or a triangle itself.
template <typename Visit>
void visit_halves(const PolygonCorners& face, const Visit& visit) {
  for (int half = 0; half < corner_count(face) - 2; ++half) visit(half, half_of(face, half));
}

/// Faces that collapsed stay in the arrays, marked. One thread at a time; all that is const may be called by many.
class QuadMesh {
 public:
  /// Corners must be < vertex_count, and those of a face distinct.
  QuadMesh(std::vector<PolygonCorners> faces, size_t vertex_count);

  size_t face_count() const { return faces_.size(); }
  size_t vertex_count() const { return stars_.vertex_count(); }
  const PolygonCorners& face(uint32_t face) const { return faces_[face]; }
  bool is_quad(uint32_t face) const { return faces_[face].w != kNoIndex; }
  bool is_alive(uint32_t face) const { return is_alive_[face]; }

  /// The living faces around a vertex. Valid until the next merge().
  std::span<const uint32_t> star(uint32_t vertex) const { return stars_.of(vertex); }

  /// What lies beyond a face's edge ab: one face, kNoIndex at a border, or kNotManifold where there are more.
  static constexpr uint32_t kNotManifold = 0xfffffffeu;
  uint32_t beyond(uint32_t face, uint32_t a, uint32_t b) const;
  /// The corner of the face from which an edge joins a and b, or -1.
  int edge_corner(uint32_t face, uint32_t a, uint32_t b) const;

  /// Takes a face away.
  void remove(uint32_t face);
  /// The vertices become the first of them. No living face may have two of them.
  void merge(std::span<const uint32_t> vertices);

 private:
  std::vector<PolygonCorners> faces_;
  std::vector<uint8_t> is_alive_;
  VertexStars stars_;
  std::vector<uint32_t> merged_star_;  ///< of the merge at hand: its memory is reused
};

}  // namespace farfield
