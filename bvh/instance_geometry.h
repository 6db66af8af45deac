// SPDX-License-Identifier: Apache-2.0
// All instances of all assets as one Embree user geometry: primitive = instance (docs/architecture.md, decision 1).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/embree.h"
#include "base/result.h"
#include "base/vec.h"
#include "bvh/level_choice.h"
#include "bvh/traced_asset.h"

namespace farfield {

/// One instance: what a ray needs in one cache line.
struct alignas(64) InstanceRecord {
  std::array<vec4, 3> world_to_local;  ///< rows
  InstanceFootprint footprint;
  uint32_t asset = 0;
  float handedness = 1;  ///< sign of the transform's determinant

  vec3 point_to_local(const vec3& p) const {
    const auto row = [&](const vec4& r) { return r.x * p.x + r.y * p.y + r.z * p.z + r.w; };
    return {row(world_to_local[0]), row(world_to_local[1]), row(world_to_local[2])};
  }
  vec3 vector_to_local(const vec3& v) const {
    const auto row = [&](const vec4& r) { return r.x * v.x + r.y * v.y + r.z * v.z; };
    return {row(world_to_local[0]), row(world_to_local[1]), row(world_to_local[2])};
  }
  /// World-space normal of a local one, up to scale: transpose(W2L) n; flips under mirroring like a flattened mesh's.
  vec3 normal_to_world(const vec3& n) const;
  /// The linear part of world_to_local.
  mat3 linear_to_local() const;
};
static_assert(sizeof(InstanceRecord) == 64);

/// An instance of `asset`, footprint not set. Errors: InvalidArgument (not finite, not invertible in float).
Result<InstanceRecord> make_instance(uint32_t asset, const mat4x3& local_to_world);
/// The largest factor by which the transform stretches a length: what instance scales mean for footprints, so that
/// an instance that is squeezed along one axis keeps the detail along the others.
float largest_stretch(const mat4x3& local_to_world);
/// World bounds that contain all that rays can hit of the instance, rounding included.
Box3 instance_bounds(const InstanceRecord& instance, const TracedAsset& asset);

/// Instances and assets, and the callbacks that Embree calls for them. Rays may run from any thread while nobody
/// changes the tables. Queries should pass the `embree` member of a RayContext or of RayContexts as context; the scene
/// must not be instanced itself.
class InstanceGeometry {
 public:
  explicit InstanceGeometry(LevelSource& source) : source_(source) {}

  std::vector<InstanceRecord> instances;
  std::vector<const TracedAsset*> assets;  ///< InstanceRecord::asset indexes it
  std::optional<float> forced_lambda;
  bool has_filters = false;  ///< RuntimeOptions::has_geometry_filters
  std::vector<bool> hidden;  ///< per instance, up to the last that no ray meets

  bool is_hidden(uint32_t instance) const { return instance < hidden.size() && hidden[instance]; }
  void set_hidden(uint32_t instance, bool is_hidden);

  /// A new user geometry over all instances, committed. Refers to this object. Call update() after instances were
  /// added, moved, hidden or shown.
  EmbreeGeometry create(EmbreeDeviceRef device);
  /// Tells Embree about the instances as they are now; the scene needs a commit too.
  void update(EmbreeGeometryRef geometry);

 private:
  static void bounds_callback(const RTCBoundsFunctionArguments* args);
  static void intersect_callback(const RTCIntersectFunctionNArguments* args);
  static void occluded_callback(const RTCOccludedFunctionNArguments* args);

  struct Visit;
  static bool intersect_level(const Visit& visit, uint64_t ray_bits, EmbreeRayHit& ray_hit,
                              EmbreeContext& embree_context, HitRecord& made);
  static bool intersect_morph(const Visit& visit, uint64_t ray_bits, EmbreeRayHit& ray_hit,
                              EmbreeContext& embree_context, HitRecord& made);
  struct Query;
  bool intersect_filtered(const Query& query, EmbreeRayHit& ray_hit, HitRecord* record) const;
  bool enter(uint32_t instance, const EmbreeRay& ray, const RayContext& context, Visit& visit) const;
  bool intersect(uint32_t instance, unsigned geometry_id, EmbreeRayHit& ray_hit, const RayContext& context,
                 EmbreeContext* embree_context, HitRecord* record) const;
  bool occluded(uint32_t instance, EmbreeRay& ray, const RayContext& context, EmbreeContext* embree_context) const;

  LevelSource& source_;
};

}  // namespace farfield
