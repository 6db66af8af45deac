// SPDX-License-Identifier: Apache-2.0
// The runtime: baked assets, their instances, a memory budget, and one Embree user geometry for all of them.
//
//   farfield::RuntimeOptions options;
//   options.budget_bytes = 4ull << 30;
//   auto runtime = farfield::Runtime::create(device, options).value();
//   farfield::AssetId oak = runtime->open_asset("oak.farfield").value();
//   runtime->add_instance(oak, local_to_world).value();
//   runtime->set_cameras({{eye, 0.0f, pixel_spread}});
//   runtime->plan_frame().value();
//   unsigned geometry = runtime->attach(scene).value();
//   rtcCommitScene(scene);
//
//   farfield::RayContext context;  // per ray
//   context.cone_spread = pixel_spread;
//   rtcIntersect1(scene, &context.embree, &ray_hit);
//   if (ray_hit.hit.geomID == geometry) {
//     farfield::Interaction hit = runtime->interaction(ray_hit, context);
//     radiance += throughput * hit.emission;
//     throughput *= hit.sample(rng).weight;
//   }
//
// value() throws what went wrong; hosts that go on without look at the Result. A test compiles these lines.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "farfield/camera.h"
#include "farfield/embree.h"
#include "farfield/export.h"
#include "farfield/instance_data.h"
#include "farfield/interaction.h"
#include "farfield/material.h"
#include "farfield/ray.h"
#include "farfield/result.h"

namespace farfield {

/// How two neighbouring levels are mixed (docs/architecture.md, decision 3).
enum class Blend : uint8_t {
  Dissolve,  ///< each path sees one of the two, picked by RayContext::path_seed
  Morph,     ///< vertices move, materials mix, and what one of the two lacks fades, all in place; where the memory for
             ///< that does not fit the budget, or the asset was baked before there were morphs, it dissolves
};

/// What a ray does that needs a level which the plan allows but which is not loaded yet.
enum class Residency : uint8_t {
  Wait,         ///< it waits until the level is there: exact, for final frames
  Progressive,  ///< it sees the finest coarser level that is resident; counted in Stats::fallbacks
};

enum class Severity : uint8_t { Info, Warning, Error };
/// Receives the library's messages, each once. Called from any thread, never concurrently.
using MessageSink = std::function<void(Severity, const std::string&)>;

/// What the budget counts for an instance in the host's scene, the worst moment of rtcCommitScene() included: in a
/// scene of Embree's defaults, and in one of RTC_BUILD_QUALITY_LOW, in which rays take about a tenth longer [measured:
/// docs/results/scale.md].
inline constexpr uint32_t kSceneBytesPerInstance = 120;
inline constexpr uint32_t kSmallSceneBytesPerInstance = 64;
/// In place of either for all instances, while any of them moves with an open shutter.
inline constexpr uint32_t kMovingSceneBytesPerInstance = 240;

struct RuntimeOptions {
  uint64_t budget_bytes = uint64_t{1} << 32;  ///< hard: levels, heap and Embree's bytes together, build peaks included
  Blend blend = Blend::Dissolve;
  float blend_window = 1.0f;  ///< octaves before a coarser level in which it blends with the finer one; in (0, 1]
  Residency residency = Residency::Wait;
  float pixel_error = 1.0f;            ///< pixels: how wide the voxels of a level may look; the budget aside. > 0
  std::optional<float> forced_lambda;  ///< every ray sees this lambda, whatever its footprint; for evaluation
  uint32_t scene_bytes_per_instance = kSceneBytesPerInstance;  ///< of the scene that attach() will be given
  /// The host has given our geometry filter functions (rtcSetGeometryIntersectFilterFunction with the geometry of
  /// geometry_id()): they are called for our hits, and occlusion queries look for nearest hits then, which costs. A
  /// filter in the query's context is called without this. Filters get one ray and its nearest hit in an instance, as
  /// rtcIntersect1 would return it; what they refuse, the ray passes, and goes on behind it.
  bool has_geometry_filters = false;
  MessageSink messages;  ///< may be empty
};

struct AssetId {
  uint32_t value;
};
struct InstanceId {
  uint32_t value;
};

/// One stored level of an open asset.
struct LevelInfo {
  uint32_t level;    ///< k
  float resolution;  ///< r_k, local units
  uint64_t triangles;
  uint64_t voxels;
  uint64_t file_bytes;
  uint64_t resident_bytes;  ///< once loaded, BVH included
};

/// What plan_frame() decided.
struct PlanSummary {
  std::vector<uint32_t> finest_level;  ///< per asset: k of the finest level that rays may use
  uint64_t planned_bytes = 0;  ///< if everything the plan allows were loaded, build peak included; <= the budget
  double bias = 0;             ///< pixel-weighted mean of how many levels coarser than asked; 0: nothing given up
  std::vector<float> levels_given_up;  ///< per asset: how many levels coarser than its finest instances ask
  uint64_t asked_bytes = 0;            ///< a budget that gives nothing up in this frame; without morphs
  uint32_t morphs = 0;                 ///< pairs of levels that morph
  uint32_t morphs_given_up = 0;        ///< pairs that instances would see morph if they fit; they dissolve
};

/// Why a ray sees what it sees of an instance whose bounds it meets; see Runtime::explain().
struct RayVisit {
  InstanceId instance;
  AssetId asset;
  float t_entry;            ///< ray parameter at which it enters the bounds
  float camera_footprint;   ///< world units: of a pixel on the instance, where a camera is nearest to it
  float ray_footprint;      ///< world units: of the ray at t_entry; the wider of the two asks for a level
  float level_0_footprint;  ///< world units: that of level 0 on this instance; level k serves what is 2^k times as wide
  float asked_lambda;       ///< the level for the footprint, before limits and the plan
  float lambda;             ///< the same within the instance's limits, no finer than the plan allows
  uint32_t level;           ///< k of what this path sees
  uint32_t next_level;      ///< k of the coarser level that it blends with; the same as level: with none
  float blend;              ///< share of next_level: of paths that see it or, if is_morph, of the morph
  bool is_morph;
  bool keeps_level;         ///< the ray has left a hit on this instance, and stays on that level
  bool is_loaded;           ///< `level` (the morph) is in memory
  uint32_t planned_finest;  ///< k of the finest level of the asset that the plan lets rays use
  LevelLimits limits;
};

/// What a stored level has taken and given so far; see Runtime::level_stats().
struct LevelRecord {
  uint64_t loads = 0;           ///< reloads included
  double load_seconds = 0;      ///< summed over loads: read, check, build
  uint64_t resident_bytes = 0;  ///< now; 0: not in memory
  uint64_t fallbacks = 0;       ///< visits of rays that asked for it and that a coarser level served
  bool is_broken = false;       ///< its file could not be read, or it did not fit
  bool is_planned = false;      ///< rays may use it under the current plan
};

/// Counters since create(). Thread-safe snapshot.
struct Stats {
  uint64_t accounted_bytes = 0;  ///< now, by the budget's rules
  uint64_t peak_accounted_bytes = 0;
  uint64_t levels_loaded = 0;  ///< loads, reloads included
  uint64_t levels_resident = 0;
  uint64_t levels_released = 0;
  uint64_t fallbacks = 0;  ///< visits of rays to instances that a coarser level served (progressive mode, broken files)
  double load_seconds = 0;  ///< summed over loads: read, check, build
  double wait_seconds =
      0;  ///< summed over threads (rays, prefetch()): in which they loaded levels or waited for others
};

/// Thread rule: interaction(), stats() and all ray queries are safe from any thread at any time between two
/// plan_frame() calls. Everything else is for one thread at a time, with no ray in flight.
class FARFIELD_API Runtime {
 public:
  /// host_device: the device of the scene that attach() will be given; retained. Errors: InvalidArgument (budget 0,
  /// pixel_error <= 0).
  static Result<std::unique_ptr<Runtime>> create(RTCDevice host_device, const RuntimeOptions& options);
  ~Runtime();
  Runtime(const Runtime&) = delete;
  Runtime& operator=(const Runtime&) = delete;

  /// Opens a baked asset: reads its manifest and checks it, loads its root. Opening the same folder again gives the
  /// same id. Errors: NotFound, Io, BadFile, Unsupported, OutOfBudget (the message has the number that would do).
  /// `materials`: the host's own for level 0 (farfield/material.h), in place of those that the bake has kept; it is
  /// called by rays from any thread, and must answer as it did in the bake for levels to match. Only the first opening
  /// of a folder counts.
  Result<AssetId> open_asset(const std::string& folder, MaterialFunction materials = {});
  /// The smallest budget in which all these folders open and so many instances of them can be planned: coarsest levels,
  /// tables, records, the host's scene; of `options` what an instance takes there. Reads the manifests alone. What
  /// single calls name in their errors is for the assets and instances that there were by then. Errors: those of
  /// open_asset() but OutOfBudget.
  static Result<uint64_t> least_budget(const std::vector<std::string>& folders, uint64_t instance_count,
                                       const RuntimeOptions& options = {});
  /// The name that the source gives a material of the instance's asset; empty for one that there is not.
  const std::string& material_name(const Interaction& interaction) const;
  /// The asset's stored levels, finest first; none for an id that open_asset() did not give.
  const std::vector<LevelInfo>& levels(AssetId asset) const;
  /// Corners of the box that contains all levels, in the space of the source. For an id that open_asset() did not give
  /// the empty box: lower is infinite, upper minus infinite.
  void bounds(AssetId asset, glm::vec3& lower, glm::vec3& upper) const;

  /// Adds an instance: 64 bytes of the budget, and those of the host's scene. local_to_world: affine, invertible,
  /// finite. data: for the host, see instance_data(); 24 bytes more for each instance once one has other data than the
  /// default. Counted at once: where it has no room beside the levels that are loaded, all but the coarsest are
  /// released until the next plan. Errors: InvalidArgument; OutOfBudget (the message has the number that would do, so
  /// far).
  Result<InstanceId> add_instance(AssetId asset, const glm::mat4x3& local_to_world, const InstanceData& data = {});
  /// Moves an instance. As with add_instance(), rays may fly again after plan_frame(), attach() and a commit of the
  /// scene; nothing else is built anew. Errors: InvalidArgument (no such instance, or as for add_instance; it stays
  /// where it is).
  Result<void> move_instance(InstanceId instance, const glm::mat4x3& local_to_world);
  /// The same, with motion while the shutter is open: where the instance is at values of RTCRay::time that are evenly
  /// spaced from 0 to 1; in between, each entry of the transform goes linearly, as those of Embree's instances do.
  /// 1 key: it stands still. At most 129; motions that are there together share times, as those with 2, 3, 5, 9, 17 ...
  /// keys do. Levels are asked for by where it is nearest, and stay the same over the shutter. 48 bytes of the budget
  /// for each key and 128 for each motion, and those that the scene takes more. Give rays that a path spawns the time
  /// of the ray that came, and interaction() the ray that hit. Errors: InvalidArgument (no such instance; keys as for
  /// add_instance; a way from key to key on which the instance is squeezed flat, such as half a turn in one step);
  /// OutOfBudget. It stays where it is then.
  Result<void> move_instance(InstanceId instance, const std::vector<glm::mat4x3>& keys);
  /// Hides an instance from all rays and plans, or shows it again; likewise. Errors: InvalidArgument (no such
  /// instance).
  Result<void> set_visible(InstanceId instance, bool is_visible);
  /// Removes an instance; likewise. The next add_instance() takes its place, and with it its id and its bytes. Errors:
  /// InvalidArgument (no such instance).
  Result<void> remove_instance(InstanceId instance);
  /// Holds the levels of an instance within limits, from the next plan_frame() on. Errors: InvalidArgument (no such
  /// instance, finest > coarsest).
  Result<void> set_level_limits(InstanceId instance, const LevelLimits& limits);
  /// The same of all instances of an asset, those that will be added too; the last call counts. Errors:
  /// InvalidArgument (no such asset, finest > coarsest).
  Result<void> set_level_limits(AssetId asset, const LevelLimits& limits);
  /// What add_instance() was given for the instance that was hit; the default for what is no hit of ours. Safe from any
  /// thread, as interaction() is.
  InstanceData instance_data(const Interaction& interaction) const;

  /// The cameras of the coming frame, or of the whole shot for levels that stay the same over it. At least one before
  /// plan_frame(), unless forced_lambda is set.
  void set_cameras(std::vector<TessellationCamera> cameras);
  /// Decides which levels the coming frame may use so that they fit the budget, releases what no longer is allowed.
  /// Call it after opening assets and adding instances too: until then rays see nothing but roots of new assets. The
  /// first rays that need a level load it, or prefetch() does. Errors: OutOfBudget (the message has the number that
  /// would do; the former plan stays), InvalidArgument (no camera).
  Result<PlanSummary> plan_frame();
  /// Loads what the cameras will certainly need under the current plan, ahead of the rays, several levels at a time
  /// where their builds fit the budget; in progressive mode starts to, and returns at once. Broken levels are reported
  /// and left out.
  void prefetch();
  /// A guess at the next frame's cameras: starts to load what they will certainly need, beside the rays of this frame,
  /// in a thread of low priority and in what the plan leaves of the budget, and returns. Changes nothing that rays see
  /// but how long they wait: the next plan_frame() keeps what its plan has and drops the rest; what fails is said when
  /// it is needed. Call it after plan_frame() and prefetch(); a further call replaces the guess, one without cameras
  /// ends it. Instances count where they are now. Takes as long as a plan_frame(); rays may fly meanwhile.
  void look_ahead(const std::vector<TessellationCamera>& next_cameras);

  /// Puts the user geometry into the host's scene and returns its geomID; the host commits the scene. Call again after
  /// adding instances. All instances are primitives of this one geometry: primID is InstanceId::value. The scene is
  /// retained until the next attach() to another one, which takes the geometry out of it; rays that reach it through an
  /// instance of it see nothing, which is said; it must not be traced or committed once the Runtime is gone. After an
  /// error nothing has changed. Errors: InvalidArgument (no scene, or one of another device), Io (what Embree says).
  Result<unsigned> attach(RTCScene scene);
  unsigned geometry_id() const;

  /// The interaction of a hit: ray_hit and context as rtcIntersect1 left them, hit.geomID == geometry_id(). A hit that
  /// is not ours, of another query than the context's, or from before the last plan_frame() and gone since, is an
  /// Interaction of Kind::None, said once; so is one whose context has had its flags overwritten.
  Interaction interaction(const RTCRayHit& ray_hit, const RayContext& context) const;

  Stats stats() const;
  /// The asset of an instance; of one that there is not: {kNoInstance}.
  AssetId asset_of(InstanceId instance) const;
  /// Per stored level of the asset, finest first, as levels() has them; none for an id that open_asset() did not give.
  std::vector<LevelRecord> level_stats(AssetId asset) const;
  /// Which instances' bounds a ray meets, nearest first, and with which level it would deal there under the current
  /// plan. Loads nothing; looks at every instance.
  std::vector<RayVisit> explain(const RTCRay& ray, const RayContext& context) const;

 private:
  Runtime();
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace farfield
