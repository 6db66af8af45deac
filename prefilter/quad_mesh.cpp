// SPDX-License-Identifier: Apache-2.0
#include "prefilter/quad_mesh.h"

#include <algorithm>

namespace farfield {

QuadMesh::QuadMesh(std::vector<PolygonCorners> faces, size_t vertex_count)
    : faces_(std::move(faces)), is_alive_(faces_.size(), 1), stars_(vertex_count) {
  for (const PolygonCorners& corners : faces_) {
    for (int c = 0; c < corner_count(corners); ++c) ++stars_[corners[c]].size;
  }
  uint32_t begin = 0;
  for (Star& star : stars_) {
    star.begin = begin;
    begin += star.size;
    star.size = 0;
  }
  star_faces_.resize(begin);
  for (uint32_t face = 0; face < faces_.size(); ++face) {
    for (int c = 0; c < corner_count(faces_[face]); ++c) {
      Star& star = stars_[faces_[face][c]];
      star_faces_[star.begin + star.size++] = face;
    }
  }
}

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
  for (const uint32_t other : star(a)) {
    if (other == face || edge_corner(other, a, b) < 0) continue;
    if (found != kNoIndex) return kNotManifold;
    found = other;
  }
  return found;
}

void QuadMesh::remove(uint32_t face) {
  is_alive_[face] = 0;
  for (int c = 0; c < corner_count(faces_[face]); ++c) {
    Star& star = stars_[faces_[face][c]];
    uint32_t* const begin = star_faces_.data() + star.begin;
    star.size = static_cast<uint32_t>(std::remove(begin, begin + star.size, face) - begin);
  }
}

void QuadMesh::merge(std::span<const uint32_t> vertices) {
  const uint32_t into = vertices.front();
  // The new star goes to the end; what it leaves behind is bounded by the number of merges times a star's size.
  const auto begin = static_cast<uint32_t>(star_faces_.size());
  for (const uint32_t vertex : vertices) {
    const Star old = stars_[vertex];
    for (uint32_t i = old.begin; i < old.begin + old.size; ++i) {
      const uint32_t face = star_faces_[i];
      for (int c = 0; c < corner_count(faces_[face]); ++c) {
        if (faces_[face][c] == vertex) faces_[face][c] = into;
      }
      star_faces_.push_back(face);
    }
    stars_[vertex] = {};
  }
  stars_[into] = {begin, static_cast<uint32_t>(star_faces_.size()) - begin};
}

}  // namespace farfield
