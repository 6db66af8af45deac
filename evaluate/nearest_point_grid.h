// SPDX-License-Identifier: Apache-2.0
// How far points are from a surface, found in a grid of its triangles: knows nothing of how surfaces are simplified.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "evaluate/triangle_distance.h"
#include "prefilter/surface.h"

namespace farfield {

/// Triangles must have area.
class NearestPointGrid {
 public:
  explicit NearestPointGrid(const Surface& surface) : surface_(surface), box_(surface.bounds()) {
    const dvec3 size(box_.size());
    const double longest = std::max({size.x, size.y, size.z});
    cell_ = longest / std::clamp(std::sqrt(static_cast<double>(surface.triangles.size()) / 6), 1.0, 128.0);
    for (int c = 0; c < 3; ++c) dims_[c] = static_cast<int>(size[c] / cell_) + 1;
    cells_.resize(static_cast<size_t>(dims_.x) * static_cast<size_t>(dims_.y) * static_cast<size_t>(dims_.z));
    for (uint32_t f = 0; f < surface.triangles.size(); ++f) {
      Box3 bounds;
      for (int c = 0; c < 3; ++c) bounds.extend(surface.positions[surface.triangles[f][c]]);
      const ivec3 lower = cell_of(bounds.lower), upper = cell_of(bounds.upper);
      for_each_cell(lower, upper, [&](const ivec3& at) { cells_[index(at)].push_back(f); });
    }
  }

  double distance(const vec3& point) const {
    const ivec3 middle = cell_of(point);
    double nearest = std::numeric_limits<double>::infinity();
    // Whatever lies outside of the cells within `reach` of the middle is at least (reach) cells away from its border.
    for (int reach = 0;; ++reach) {
      for_each_cell(clamped(middle - reach), clamped(middle + reach), [&](const ivec3& at) {
        const ivec3 off = glm::abs(at - middle);
        if (std::max({off.x, off.y, off.z}) != reach) return;
        for (const uint32_t f : cells_[index(at)]) nearest = std::min(nearest, distance_to(f, point));
      });
      const bool is_all = clamped(middle - reach) == ivec3(0) && clamped(middle + reach) == dims_ - 1;
      if (is_all || nearest <= reach * cell_ - distance_to_cell(point, middle)) return nearest;
    }
  }

 private:
  double distance_to(uint32_t f, const vec3& point) const {
    const uvec3& t = surface_.triangles[f];
    return distance_to_triangle(dvec3(point), dvec3(surface_.positions[t.x]), dvec3(surface_.positions[t.y]),
                                dvec3(surface_.positions[t.z]));
  }
  ivec3 clamped(const ivec3& at) const { return glm::clamp(at, ivec3(0), dims_ - 1); }
  ivec3 cell_of(const vec3& p) const { return clamped(ivec3(glm::floor((dvec3(p) - dvec3(box_.lower)) / cell_))); }
  /// How far the point is outside of its cell, as points outside of the bounds are.
  double distance_to_cell(const vec3& p, const ivec3& at) const {
    const dvec3 low = dvec3(box_.lower) + dvec3(at) * cell_;
    return glm::length(dvec3(p) - glm::clamp(dvec3(p), low, low + cell_));
  }
  size_t index(const ivec3& at) const {
    return static_cast<size_t>(at.x) +
           static_cast<size_t>(dims_.x) *
               (static_cast<size_t>(at.y) + static_cast<size_t>(dims_.y) * static_cast<size_t>(at.z));
  }
  template <typename Visit>
  static void for_each_cell(const ivec3& lower, const ivec3& upper, const Visit& visit) {
    for (int z = lower.z; z <= upper.z; ++z) {
      for (int y = lower.y; y <= upper.y; ++y) {
        for (int x = lower.x; x <= upper.x; ++x) visit(ivec3(x, y, z));
      }
    }
  }

  const Surface& surface_;
  Box3 box_;
  double cell_ = 0;
  ivec3 dims_{1};
  std::vector<std::vector<uint32_t>> cells_;
};

}  // namespace farfield
