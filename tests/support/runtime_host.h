// SPDX-License-Identifier: Apache-2.0
// A host around a Runtime, and assets whose sizes are right for it.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/embree.h"
#include "cache/level.h"
#include "farfield/runtime.h"

namespace farfield::test {

/// Writes an asset of these levels, finest first, measured as the bake would. Stops the test program if it cannot.
void write_asset(const std::filesystem::path& folder, const std::vector<LevelData>& levels, dvec3 origin = dvec3(0.0));

/// An Embree device and scene around a runtime, as a host has them.
class Host {
 public:
  explicit Host(RuntimeOptions options = {});
  Runtime& runtime() { return *runtime_; }
  EmbreeDeviceRef device() { return device_.get(); }
  EmbreeSceneRef scene() { return scene_.get(); }  ///< after plan()
  /// Opens, adds one instance per transform. Fails the test on errors.
  AssetId add(const std::filesystem::path& folder, const std::vector<mat4x3>& transforms = {mat4x3(1.0f)});
  /// Plans for one camera at `position` and commits the scene.
  PlanSummary plan(const vec3& position = vec3(0, 0, 10), float pixel_spread = 1e-3f);
  void commit();
  /// The nearest hit from origin along direction. True: hit on Farfield geometry.
  bool trace(const vec3& origin, const vec3& direction, RayContext& context, EmbreeRayHit& ray_hit) const;
  bool trace(RayContext& context, EmbreeRayHit& ray_hit) const;  ///< the same of a ray that is made already
  Interaction interaction(const EmbreeRayHit& ray_hit, const RayContext& context) const {
    return runtime_->interaction(ray_hit, context);
  }

  std::vector<std::string> messages;
  /// While levels may be loading ahead, in a thread of the runtime's own, which adds to them.
  size_t message_count() const;

 private:
  mutable std::mutex messages_mutex_;
  EmbreeDevice device_;
  std::unique_ptr<Runtime> runtime_;
  EmbreeScene scene_;
};

/// A hash of what 20000 fixed rays see around the unit sphere's place: instance, element, level, t; on all threads.
uint64_t hash_of_hits(const Host& host, float spread = 0.0f);

}  // namespace farfield::test
