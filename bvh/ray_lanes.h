// SPDX-License-Identifier: Apache-2.0
// A ray of Embree's, put into another space and back.
#pragma once

#include <algorithm>
#include <cstddef>

#include "base/embree.h"
#include "base/float4.h"
#include "base/vec.h"

namespace farfield {

/// A ray in the lanes that Embree has it in: w is tnear and time.
struct RayLanes {
  Float4 origin;
  Float4 direction;

  static RayLanes of(const EmbreeRay& ray) { return {load4(&ray.org_x), load4(&ray.dir_x)}; }
  void store_to(EmbreeRay& ray) const { store4(&ray.org_x, origin), store4(&ray.dir_x, direction); }
  /// By a matrix as transform_vector() wants it. The direction keeps its length's meaning: t is the same in both
  /// spaces.
  RayLanes transformed(const mat4x3& matrix) const {
    return {with_w_of(transform_point(matrix, origin), origin),
            with_w_of(transform_vector(matrix, direction), direction)};
  }
};
static_assert(offsetof(EmbreeRay, tnear) == 3 * sizeof(float) && offsetof(EmbreeRay, dir_x) == 4 * sizeof(float) &&
              offsetof(EmbreeRay, time) == 7 * sizeof(float));

/// Bounds of what such rays look for in a space of its own, as a ray meets them before it is put there: larger by the
/// rounding of the transform, a few times 2^-24 of the coordinates that it adds up.
inline Box3 padded_for_local_rays(const Box3& bounds) {
  constexpr float kRelativePad = 1e-6f;  // of their size and of their distance from the origin
  const float far = std::max(max_component(glm::abs(bounds.lower)), max_component(glm::abs(bounds.upper)));
  const vec3 pad(kRelativePad * (max_component(bounds.size()) + far));
  return {bounds.lower - pad, bounds.upper + pad};
}

/// Puts a ray into a space, and back at the end of the scope.
class InSpace {
 public:
  InSpace(EmbreeRay& ray, const RayLanes& in_space) : ray_(ray), before_(RayLanes::of(ray)) { in_space.store_to(ray); }
  ~InSpace() { before_.store_to(ray_); }
  InSpace(const InSpace&) = delete;
  InSpace& operator=(const InSpace&) = delete;

 private:
  EmbreeRay& ray_;
  RayLanes before_;
};

}  // namespace farfield
