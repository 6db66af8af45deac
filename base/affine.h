// SPDX-License-Identifier: Apache-2.0
// Affine transforms, looked at in double.
#pragma once

#include "base/vec.h"

namespace farfield {

inline glm::dmat3 linear_part(const mat4x3& m) { return glm::dmat3(glm::dmat4x3(m)); }

/// The inverse of a transform whose determinant is not 0.
inline glm::dmat4x3 inverse_of(const glm::dmat4x3& transform) {
  const glm::dmat3 linear = glm::inverse(glm::dmat3(transform));
  return {linear[0], linear[1], linear[2], -(linear * transform[3])};
}

/// Whether all of it, as floats, is finite and no larger than what Embree takes.
inline bool is_in_range(const glm::dmat4x3& m) {
  for (int column = 0; column < 4; ++column) {
    const vec3 v(m[column]);
    if (!is_finite(v) || max_component(glm::abs(v)) > kEmbreeLargest) return false;
  }
  return true;
}

}  // namespace farfield
