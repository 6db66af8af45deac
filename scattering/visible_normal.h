// SPDX-License-Identifier: Apache-2.0
// Shading normals as light may use them.
#pragma once

#include "base/vec.h"

namespace farfield {

/// A unit shading normal turned to the side of the surface that wo sees, and not beyond wo's own horizon. All unit;
/// geometric_normal.wo >= 0.
inline vec3 visible_normal(vec3 normal, const vec3& geometric_normal, const vec3& wo) {
  constexpr float kLeastCosine = 0.02f;
  if (glm::dot(normal, geometric_normal) < 0.0f) normal = -normal;
  const float cosine = glm::dot(normal, wo);
  return cosine >= kLeastCosine ? normal : glm::normalize(normal + (kLeastCosine - cosine) * wo);
}

}  // namespace farfield
