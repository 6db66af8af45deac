// SPDX-License-Identifier: Apache-2.0
// Triangles to cast rays at.
#pragma once

#include <embree3/rtcore.h>

#include <memory>
#include <optional>
#include <type_traits>

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
  /// Errors: see is_valid().
  explicit RayScene(const Surface& geometry);
  /// Whether Embree could build the scene (it had the memory).
  bool is_valid() const;

  std::optional<RayHit> first_hit(const vec3& origin, const vec3& direction, float length) const;
  /// Whether anything is in the way between these distances.
  bool is_occluded(const vec3& origin, const vec3& direction, float near, float far) const;

 private:
  struct DeleteDevice {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  };
  struct DeleteScene {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };

  std::unique_ptr<std::remove_pointer_t<RTCDevice>, DeleteDevice> device_;
  std::unique_ptr<std::remove_pointer_t<RTCScene>, DeleteScene> scene_;
};

}  // namespace farfield
