// SPDX-License-Identifier: Apache-2.0
// The faces around each vertex of a mesh, while faces go and vertices merge.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace farfield {

/// One thread at a time; all that is const may be called by many.
class VertexStars {
 public:
  VertexStars() = default;
  /// visit_corners(face, visit): calls visit(vertex) for each corner of a face.
  template <typename VisitCorners>
  VertexStars(size_t vertex_count, size_t face_count, const VisitCorners& visit_corners) : stars_(vertex_count) {
    for (uint32_t face = 0; face < face_count; ++face) {
      visit_corners(face, [&](uint32_t vertex) { ++stars_[vertex].size; });
    }
    uint32_t begin = 0;
    for (Star& star : stars_) {
      star.begin = begin;
      begin += star.size;
      star.size = 0;
    }
    faces_.resize(begin);
    for (uint32_t face = 0; face < face_count; ++face) {
      visit_corners(face, [&](uint32_t vertex) {
        Star& star = stars_[vertex];
        faces_[star.begin + star.size++] = face;
      });
    }
  }

  size_t vertex_count() const { return stars_.size(); }
  /// Valid until the next replace().
  std::span<const uint32_t> of(uint32_t vertex) const {
    return std::span(faces_).subspan(stars_[vertex].begin, stars_[vertex].size);
  }

  void remove(uint32_t vertex, uint32_t face) {
    Star& star = stars_[vertex];
    uint32_t* const begin = faces_.data() + star.begin;
    star.size = static_cast<uint32_t>(std::remove(begin, begin + star.size, face) - begin);
  }
  void clear(uint32_t vertex) { stars_[vertex] = {}; }
  /// The new star, which must not be a view of an old one, goes to the end; what it leaves behind is bounded by the
  /// number of merges times a star's size.
  void replace(uint32_t vertex, std::span<const uint32_t> faces) {
    stars_[vertex] = {static_cast<uint32_t>(faces_.size()), static_cast<uint32_t>(faces.size())};
    faces_.insert(faces_.end(), faces.begin(), faces.end());
  }

 private:
  struct Star {
    uint32_t begin = 0, size = 0;
  };
  std::vector<Star> stars_;
  std::vector<uint32_t> faces_;
};

}  // namespace farfield
