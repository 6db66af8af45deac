// SPDX-License-Identifier: Apache-2.0
// Which faces meet at which edge: the only topology that the surface half of the bake needs. Winding plays no role.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace farfield {

/// The edges of a triangle mesh, numbered by (smaller vertex, larger vertex) in ascending order. An edge with one face
/// is a border, with more than two non-manifold. A plain value.
struct EdgeTable {
  std::vector<uint32_t> smaller_vertex, larger_vertex;  ///< per edge
  std::vector<uvec3> face_edges;                        ///< per face: edge c joins its corners c and (c + 1) % 3
  std::vector<uint32_t> first_face;  ///< per edge, and one past the last: where its faces begin in `faces`
  std::vector<uint32_t> faces;       ///< ascending per edge

  uint32_t size() const { return static_cast<uint32_t>(smaller_vertex.size()); }
  std::span<const uint32_t> faces_of(uint32_t edge) const {
    return std::span(faces).subspan(first_face[edge], first_face[edge + 1] - first_face[edge]);
  }
};

/// Builds the table in time linear in the number of faces (for bounded valence). Indices must be < vertex_count.
EdgeTable build_edge_table(std::span<const uvec3> triangles, size_t vertex_count);

/// Whether the face, which has the edge, runs from its smaller to its larger vertex.
bool runs_upwards(std::span<const uvec3> triangles, const EdgeTable& edges, uint32_t face, uint32_t edge);

/// Per face: whether it is wound against its neighbours, outwards from the first face of each sheet through edges of
/// two faces; meaningless across a Moebius strip's seam.
std::vector<uint8_t> flipped_faces(std::span<const uvec3> triangles, const EdgeTable& edges);

}  // namespace farfield
