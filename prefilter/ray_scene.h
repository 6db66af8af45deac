// SPDX-License-Identifier: Apache-2.0
// Triangles to cast rays at.
#pragma once

#include <optional>

#include "base/embree.h"
#include "base/result.h"
#include "base/vec.h"
#include "prefilter/surface.h"

namespace farfield {

struct RayHit {
  uint32_t triangle = 0;
  float distance = 0;
  vec3 normal{0.0f};  ///< of the triangle, any length, either side
};

/// The triangles of a surface as an Embree scene on a device of its own. The surface must outlive it. What a ray hits
/// does not depend on the number of threads. Rays may be cast from any thread; directions are unit.
class RayScene {
 public:
  /// Errors: Unsupported (Embree does not start), Io (out of memory, or what else Embree says).
  static Result<RayScene> build(const Surface& geometry);

  std::optional<RayHit> first_hit(const vec3& origin, const vec3& direction, float length) const;
  /// Whether anything is in the way between these distances.
  bool is_occluded(const vec3& origin, const vec3& direction, float near, float far) const;

 private:
  RayScene() = default;

  EmbreeDevice device_;  // first: the scene lives on it
  EmbreeScene scene_;
};

}  // namespace farfield
