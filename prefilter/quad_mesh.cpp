// SPDX-License-Identifier: Apache-2.0
#include "prefilter/quad_mesh.h"

#include <utility>

namespace farfield {

QuadMesh::QuadMesh(std::vector<PolygonCorners> faces, size_t vertex_count)
    : faces_(std::move(faces)),
      is_alive_(faces_.size(), 1),
      stars_(vertex_count, faces_.size(), [&](uint32_t face, const auto& visit) {
        for (int c = 0; c < corner_count(faces_[face]); ++c) visit(faces_[face][c]);
      }) {}

int QuadMesh::edge_corner(uint32_t face, uint32_t a, uint32_t b) const {
  const PolygonCorners& corners = faces_[face];
  const int count = corner_count(corners);
  for (int c = 0; c < count; ++c) {
    const uint32_t p = corners[c], q = corners[(c + 1) % count];
    if ((p == a && q == b) || (p == b && q == a)) return c;
  }
  return -1;
}

uint32_t QuadMesh::beyond(uint32_t face, uint32_t a, uint32_t b) const {
  uint32_t found = kNoIndex;
  // Around the one with fewer faces: those at a pole of thousands ask for each other's neighbours.
  for (const uint32_t other : star(star(b).size() < star(a).size() ? b : a)) {
    if (other == face || edge_corner(other, a, b) < 0) continue;
    if (found != kNoIndex) return kNotManifold;
    found = other;
  }
  return found;
}

void QuadMesh::remove(uint32_t face) {
  is_alive_[face] = 0;
  for (int c = 0; c < corner_count(faces_[face]); ++c) stars_.remove(faces_[face][c], face);
}

void QuadMesh::merge(std::span<const uint32_t> vertices) {
  const uint32_t into = vertices.front();
  merged_star_.clear();
  for (const uint32_t vertex : vertices) {
    for (const uint32_t face : stars_.of(vertex)) {
      for (int c = 0; c < corner_count(faces_[face]); ++c) {
        if (faces_[face][c] == vertex) faces_[face][c] = into;
      }
      merged_star_.push_back(face);
    }
    stars_.clear(vertex);
  }
  stars_.replace(into, merged_star_);
}

}  // namespace farfield
