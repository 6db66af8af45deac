// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "base/vec.h"

namespace farfield {

/// From a point to the nearest point of the triangle a b c, which has area.
inline double distance_to_triangle(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
  const dvec3 n = glm::cross(b - a, c - a);
  const auto is_inside = [&](const dvec3& from, const dvec3& to) {
    return glm::dot(glm::cross(to - from, p - from), n) >= 0;
  };
  if (is_inside(a, b) && is_inside(b, c) && is_inside(c, a)) return std::abs(glm::dot(p - a, n)) / glm::length(n);
  const auto to_edge = [&](const dvec3& from, const dvec3& to) {
    const dvec3 d = to - from;
    const double t = std::clamp(glm::dot(p - from, d) / glm::dot(d, d), 0.0, 1.0);
    return glm::length(p - from - t * d);
  };
  return std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
}

}  // namespace farfield
