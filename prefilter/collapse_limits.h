// SPDX-License-Identifier: Apache-2.0
// What no collapse may do to a face, whether of an edge or of a face loop.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "base/vec.h"

namespace farfield {

inline constexpr double kMaxDeviation = 0.25;    ///< largest distance to the input, as a part of the resolution (8.1.1)
inline constexpr double kMinNormalCosine = 0.2;  ///< between a face before and after a collapse
inline constexpr double kMinShape =
    0.05;  ///< of 4 sqrt(3) area / (sum of squared edges), 1 for an equilateral triangle
inline constexpr size_t kMaxStarFaces = 256;  ///< around a vertex: keeps the work per collapse bounded

using Corners = std::array<dvec3, 3>;

inline double squared_length(const dvec3& v) { return glm::dot(v, v); }

/// Twice the area, along the normal.
inline dvec3 area_vector(const Corners& t) { return glm::cross(t[1] - t[0], t[2] - t[0]); }

inline double shape(const Corners& t) {
  const double edges2 = squared_length(t[1] - t[0]) + squared_length(t[2] - t[1]) + squared_length(t[0] - t[2]);
  return edges2 > 0 ? 2.0 * std::sqrt(3.0) * glm::length(area_vector(t)) / edges2 : 0.0;
}

/// Whether a triangle that becomes another neither turns over nor becomes a needle. Corners in the same order, up to a
/// rotation.
inline bool keeps_face(const Corners& before, const Corners& after) {
  const double shape_before = shape(before);
  if (!(shape(after) > std::min(kMinShape, 0.5 * shape_before))) return false;
  if (!(shape_before > 0)) return true;
  const dvec3 normal_before = area_vector(before), normal_after = area_vector(after);
  return glm::dot(normal_before, normal_after) >
         kMinNormalCosine * glm::length(normal_before) * glm::length(normal_after);
}

}  // namespace farfield
