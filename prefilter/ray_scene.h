// SPDX-License-Identifier: Apache-2.0
// Triangles to cast rays at.
#pragma once

#include <optional>

#include "base/embree.h"
#include "base/result.h"
#include "base/split_mix.h"
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

  std::optional<RayHit> first_hit(const vec3& origin, const vec3& direction, float near, float far) const;
  /// Whether anything is in the way between these distances.
  bool is_occluded(const vec3& origin, const vec3& direction, float near, float far) const;

 private:
  RayScene() = default;

  EmbreeDevice device_;  // first: the scene lives on it
  EmbreeScene scene_;
};

/// The same with opacities: a face stops as many rays as its opacity says, and lets the others pass.
class OpacityScene {
 public:
  /// Errors: those of RayScene::build().
  static Result<OpacityScene> build(const Surface& geometry);

  const Surface& surface() const { return *geometry_; }

  /// The first face that stops the ray. `random` is used only where faces are not opaque.
  std::optional<RayHit> first_stop(const vec3& origin, const vec3& direction, float far, SplitMix& random) const;
  /// Whether any face between these distances stops it.
  bool is_stopped(const vec3& origin, const vec3& direction, float near, float far, SplitMix& random) const;

 private:
  OpacityScene(const Surface& geometry, RayScene scene);
  std::optional<RayHit> first_stop(const vec3& origin, const vec3& direction, float near, float far,
                                   SplitMix& random) const;

  const Surface* geometry_;
  RayScene scene_;
  bool is_opaque_;  ///< no ray passes any face
};

}  // namespace farfield
