// SPDX-License-Identifier: Apache-2.0
// Small baked assets on disk, made without the bake, and a host around a Runtime.
#pragma once

#include <embree3/rtcore.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "cache/level.h"
#include "farfield/runtime.h"

namespace farfield::testing {

/// A folder that is there during a test.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Writes an asset of these levels, finest first, measured as the bake would. Stops the test program if it cannot.
void write_asset(const std::filesystem::path& folder, const std::vector<LevelData>& levels, dvec3 origin = dvec3(0.0));

/// A white sphere of radius 1 around the origin: level 0 and 1 meshes, level 2 a mesh in thin haze, level 3 and 5
/// (there is no 4) dense voxels. `rings` sets the size of level 0.
std::vector<LevelData> white_sphere(uint32_t rings = 64);

/// Gives every face and voxel of a level this diffuse albedo.
void set_diffuse(LevelData& level, const vec3& albedo);

/// An Embree device and scene around a runtime, as a host has them.
class Host {
 public:
  explicit Host(RuntimeOptions options = {});
  ~Host();
  Runtime& runtime() { return *runtime_; }
  RTCDevice device() { return device_; }
  /// Opens, adds one instance per transform. Fails the test on errors.
  AssetId add(const std::filesystem::path& folder, const std::vector<mat4x3>& transforms = {mat4x3(1.0f)});
  /// Plans for one camera at `position` and commits the scene.
  PlanSummary plan(const vec3& position = vec3(0, 0, 10), float pixel_spread = 1e-3f);
  void commit();
  /// rtcIntersect1 from origin along direction. True: hit on Farfield geometry.
  bool trace(const vec3& origin, const vec3& direction, RayContext& context, RTCRayHit& ray_hit) const;
  Interaction interaction(const RTCRayHit& ray_hit, const RayContext& context) const {
    return runtime_->interaction(ray_hit, context);
  }

  std::vector<std::string> messages;

 private:
  RTCDevice device_;
  RTCScene scene_ = nullptr;
  std::unique_ptr<Runtime> runtime_;
};

/// A hash of what 20000 fixed rays see around the unit sphere's place: instance, element, level, t; on all threads.
uint64_t hash_of_hits(const Host& host, float spread = 0.0f);

}  // namespace farfield::testing
