// SPDX-License-Identifier: Apache-2.0
// All instances of all assets as one Embree user geometry: primitive = instance (docs/architecture.md, decision 1).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "base/embree.h"
#include "base/result.h"
#include "base/vec.h"
#include "bvh/instance_motion.h"
#include "bvh/instance_record.h"
#include "bvh/traced_asset.h"

namespace farfield {

/// The context is that of a RayContext, as its constructor has made it: not if somebody has overwritten its flags.
bool is_of_ray_context(const EmbreeContext& context);

/// Instances and assets, and the callbacks that Embree calls for them. Rays may run from any thread while nobody
/// changes the tables. Queries should pass the `embree` member of a RayContext or of RayContexts as context; where the
/// scene is instanced itself, rays pass, and LevelSource::refuse_nested() is called.
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
  /// The instance at a ray's time: its record, or `moved` after that was made to hold what a moving one is.
  const InstanceRecord& record_at(uint32_t instance, float time, std::optional<InstanceRecord>& moved) const {
    const InstanceRecord& record = instances[instance];
    return record.moves ? move(instance, time, moved) : record;
  }
  /// The level that a ray would deal with in an instance, and where it enters the bounds; none: it passes them by.
  struct Entry {
    float t;
    LevelChoice choice;
  };
  std::optional<Entry> entry_of(uint32_t instance, const EmbreeRay& ray, const RayContext& context) const;
  /// World bounds of the instance over all ray times.
  Box3 bounds_over_time(uint32_t instance) const;
  /// How an instance moves while the shutter is open; none: it stands still.
  std::optional<InstanceMotion> motion(uint32_t instance) const;
  /// The record of an instance that moves is that of the beginning. Errors: InvalidArgument (its keys and those of
  /// other motions have no common times that Embree could take; the former motion stays).
  Result<void> set_motion(uint32_t instance, std::optional<InstanceMotion> motion);
  uint64_t motion_bytes() const { return motion_bytes_; }

  /// A new user geometry over all instances, committed. Refers to this object. Call update() after instances were
  /// added, moved, hidden or shown.
  EmbreeGeometry create(EmbreeDeviceRef device);
  /// Tells Embree about the instances as they are now; the scene needs a commit too.
  void update(EmbreeGeometryRef geometry);

 private:
  uint64_t time_segments() const;
  void replace_motion(uint32_t instance, std::optional<InstanceMotion> motion);
  [[gnu::noinline]] const InstanceRecord& move(uint32_t instance, float time,
                                               std::optional<InstanceRecord>& moved) const;
  static void bounds_callback(const RTCBoundsFunctionArguments* args);
  static void intersect_callback(const RTCIntersectFunctionNArguments* args);
  static void occluded_callback(const RTCOccludedFunctionNArguments* args);

  struct Visit;
  struct Query;
  bool is_plain(unsigned ray_count, const EmbreeContext& context) const;
  // Not inlined: their frames would be in the way of plain rays.
  [[gnu::noinline]] void intersect_others(const RTCIntersectFunctionNArguments* args) const;
  [[gnu::noinline]] void occlude_others(const RTCOccludedFunctionNArguments* args) const;
  bool intersect_filtered(const Query& query, EmbreeRayHit& ray_hit, HitRecord* record) const;
  static bool intersect_level(const Visit& visit, uint64_t ray_bits, EmbreeRayHit& ray_hit,
                              EmbreeContext& embree_context, HitRecord& made);
  static bool intersect_morph(const Visit& visit, uint64_t ray_bits, EmbreeRayHit& ray_hit,
                              EmbreeContext& embree_context, HitRecord& made);
  bool choose(const InstanceRecord& record, uint32_t instance, const EmbreeRay& ray, const RayContext& context,
              Visit& visit) const;
  bool enter(const InstanceRecord& record, uint32_t instance, const EmbreeRay& ray, const RayContext& context,
             Visit& visit) const;
  bool intersect(uint32_t instance, unsigned geometry_id, EmbreeRayHit& ray_hit, const RayContext& context,
                 EmbreeContext* embree_context, HitRecord* record) const;
  bool occluded(uint32_t instance, EmbreeRay& ray, RayContext& context, EmbreeContext* embree_context) const;

  LevelSource& source_;
  std::unordered_map<uint32_t, InstanceMotion> motions_;  ///< of the instances whose record says that they move
  std::map<size_t, size_t> motions_with_segments_;        ///< how many motions have how many segments between keys
  uint64_t motion_bytes_ = 0;
  uint64_t time_segments_ = 0;  ///< of Embree's geometry; 0 where nothing moves
};

}  // namespace farfield
