// SPDX-License-Identifier: Apache-2.0
// The public face. Assets and their levels: level_store. What the cameras ask for: frame_planner. The host's scene:
// host_scene. Shading: interaction.
#include "farfield/runtime.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "runtime/explain.h"
#include "runtime/frame_planner.h"
#include "runtime/host_scene.h"
#include "runtime/interaction_model.h"
#include "runtime/level_store.h"

namespace farfield {

namespace {

Result<void> check_options(const RuntimeOptions& options) {
  const auto invalid = [](const char* what) { return make_error(ErrorCode::InvalidArgument, what); };
  if (options.budget_bytes == 0) return invalid("the budget is 0 bytes; give RuntimeOptions::budget_bytes a size");
  if (!(options.pixel_error > 0.0f) || !std::isfinite(options.pixel_error))
    return invalid("pixel_error must be positive");
  if (!(options.blend_window > 0.0f && options.blend_window <= 1.0f)) return invalid("blend_window must be in (0, 1]");
  if (options.forced_lambda && !std::isfinite(*options.forced_lambda)) return invalid("forced_lambda must be finite");
  return {};
}

/// M after a translation by `origin`, in double: both may be far from zero and cancel. Before that, a rotation.
mat4x3 with_origin(const mat4x3& m, const dvec3& origin, const glm::dmat3& rotation) {
  const glm::dmat3 linear{dvec3(m[0]), dvec3(m[1]), dvec3(m[2])};
  mat4x3 result = m;
  if (rotation != glm::dmat3(1.0)) {
    const glm::dmat3 turned = linear * rotation;
    result = mat4x3(vec3(turned[0]), vec3(turned[1]), vec3(turned[2]), m[3]);
  }
  result[3] = vec3(dvec3(m[3]) + linear * origin);
  return result;
}

uint64_t bytes_per_instance(const RuntimeOptions& options, bool does_any_move = false) {
  const uint32_t in_scene = options.scene_bytes_per_instance;
  return sizeof(InstanceRecord) + (does_any_move ? std::max(in_scene, kMovingSceneBytesPerInstance) : in_scene);
}

tl::unexpected<Error> no_such_instance(InstanceId instance) {
  return make_error(ErrorCode::InvalidArgument, fmt::format("there is no instance {}", instance.value));
}

tl::unexpected<Error> no_such_asset(AssetId asset) {
  return make_error(ErrorCode::InvalidArgument, fmt::format("there is no asset {}", asset.value));
}

Result<void> check_limits(const LevelLimits& limits) {
  if (limits.finest <= limits.coarsest) return {};
  return make_error(ErrorCode::InvalidArgument, fmt::format("no level is between {} and {}: the finest comes first",
                                                            limits.finest, limits.coarsest));
}

Result<std::filesystem::path> canonical_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::path canonical = std::filesystem::canonical(folder, error);
  if (!error) return canonical;
  return make_error(ErrorCode::NotFound, fmt::format("cannot open the asset {}: {}", folder, error.message()));
}

}  // namespace

struct Runtime::Impl {
  Impl(RTCDevice host_device, const RuntimeOptions& runtime_options, std::unique_ptr<BvhDevice> level_device)
      : options(runtime_options),
        messages(runtime_options.messages),
        levels(std::move(level_device), options, messages),
        planner(options, geometry),
        host(host_device) {
    geometry.forced_lambda = options.forced_lambda;
    geometry.has_filters = options.has_geometry_filters;
  }

  /// Tells the budget what so many instances take, of which the first `with_data` have data of the host's. The room
  /// that the arrays have beyond was never touched: it is not resident.
  Result<void> count_instances(size_t count, size_t with_data) {
    return levels.set_instance_bytes(count * bytes_per_instance(options, geometry.motion_bytes() > 0) +
                                     geometry.motion_bytes() + with_data * sizeof(InstanceData));
  }
  Result<void> count_instances() { return count_instances(geometry.instances.size(), instance_data.size()); }
  bool has_instance(InstanceId instance) const {
    return instance.value < geometry.instances.size() && !free_ids.contains(instance.value);
  }
  Result<InstanceRecord> make_record(uint32_t asset, const mat4x3& local_to_world) const;
  /// An asset's transform to the world, of that of its source.
  mat4x3 asset_to_world(uint32_t asset, const mat4x3& local_to_world) const;
  /// Puts an instance elsewhere; its limits stay. After an error it is where it was.
  Result<void> place(uint32_t instance, const InstanceRecord& record, std::optional<InstanceMotion> motion);
  /// What was hit; its level is null if the record is not of a hit, or the level has gone since.
  HitLevels levels_of(const HitRecord& hit) const;

  const RuntimeOptions options;
  Messages messages;
  LevelStore levels;
  InstanceGeometry geometry{levels};
  FramePlanner planner;
  HostScene host;
  std::vector<LevelLimits> asset_limits;    ///< per asset, up to the last that has any
  std::vector<InstanceData> instance_data;  ///< per instance, up to the last one that has any
  std::set<uint32_t> free_ids;              ///< of instances that were removed: the lowest is the next one's
  std::atomic<bool> said_stale_hit{false}, said_flags{false};
};

HitLevels Runtime::Impl::levels_of(const HitRecord& hit) const {
  if (hit.instance >= geometry.instances.size()) return {};
  const TracedAsset& asset = *geometry.assets[geometry.instances[hit.instance].asset];
  if (hit.level_slot >= asset.slot_count()) return {};
  HitLevels found;
  if (hit.blend > 0.0f) {
    found.morph = asset.morphs[hit.level_slot].load(std::memory_order_acquire);
    if (!found.morph) return {};
    found.level = hit.is_coarser ? &found.morph->coarse() : &found.morph->fine();
  } else {
    found.level = asset.loaded[hit.level_slot].load(std::memory_order_acquire);
  }
  if (found.level && !is_hit_of(*found.level, hit)) return {};
  return found;
}

Runtime::Runtime() = default;
Runtime::~Runtime() = default;

Result<std::unique_ptr<Runtime>> Runtime::create(RTCDevice host_device, const RuntimeOptions& options) {
  if (!host_device) return make_error(ErrorCode::InvalidArgument, "Runtime::create needs the host's Embree device");
  FARFIELD_TRY(check_options(options));
  FARFIELD_TRY_LET(auto device, BvhDevice::create());
  std::unique_ptr<Runtime> runtime(new Runtime);
  runtime->impl_ = std::make_unique<Impl>(host_device, options, std::move(device));
  return runtime;
}

Result<AssetId> Runtime::open_asset(const std::string& folder, MaterialFunction materials) {
  FARFIELD_TRY_LET(const auto canonical, canonical_folder(folder));
  Impl& impl = *impl_;
  FARFIELD_TRY_LET(const uint32_t asset, impl.levels.open(canonical, std::move(materials)));
  if (asset == impl.geometry.assets.size()) impl.geometry.assets.push_back(&impl.levels.asset(asset).traced);
  return AssetId{asset};
}

Result<uint64_t> Runtime::least_budget(const std::vector<std::string>& folders, uint64_t instance_count,
                                       const RuntimeOptions& options) {
  std::set<std::filesystem::path> each_once;
  for (const std::string& folder : folders) {
    FARFIELD_TRY_LET(auto canonical, canonical_folder(folder));
    each_once.insert(std::move(canonical));
  }
  return LevelStore::least_bytes(std::vector(each_once.begin(), each_once.end()), options.blend,
                                 instance_count * bytes_per_instance(options));
}

const std::string& Runtime::material_name(const Interaction& interaction) const {
  static const std::string none;
  const std::vector<InstanceRecord>& instances = impl_->geometry.instances;
  if (interaction.instance >= instances.size()) return none;
  return impl_->levels.asset(instances[interaction.instance].asset).close_up->material_name(interaction.material);
}

const std::vector<LevelInfo>& Runtime::levels(AssetId asset) const {
  static const std::vector<LevelInfo> none;
  return asset.value < impl_->levels.asset_count() ? impl_->levels.asset(asset.value).levels : none;
}

void Runtime::bounds(AssetId asset, glm::vec3& lower, glm::vec3& upper) const {
  const bool is_known = asset.value < impl_->levels.asset_count();
  const Box3 box = is_known ? impl_->levels.asset(asset.value).bounds_source : Box3();
  lower = box.lower;
  upper = box.upper;
}

mat4x3 Runtime::Impl::asset_to_world(uint32_t asset, const mat4x3& local_to_world) const {
  const OpenAsset& opened = levels.asset(asset);
  return with_origin(local_to_world, opened.origin, opened.rotation);
}

Result<InstanceRecord> Runtime::Impl::make_record(uint32_t asset, const mat4x3& local_to_world) const {
  FARFIELD_TRY_LET(auto record, make_instance(asset, asset_to_world(asset, local_to_world)));
  record.footprint.world_to_r0 = options.pixel_error / largest_stretch(local_to_world);
  if (asset < asset_limits.size()) record.limits = asset_limits[asset];
  return record;
}

Result<InstanceId> Runtime::add_instance(AssetId asset, const glm::mat4x3& local_to_world, const InstanceData& data) {
  Impl& impl = *impl_;
  if (asset.value >= impl.levels.asset_count()) {
    return no_such_asset(asset);
  }
  FARFIELD_TRY_LET(auto record, impl.make_record(asset.value, local_to_world));
  std::vector<InstanceRecord>& instances = impl.geometry.instances;
  const bool is_new = impl.free_ids.empty();
  if (is_new && instances.size() >= kNoInstance) return make_error(ErrorCode::InvalidArgument, "too many instances");
  const size_t id = is_new ? instances.size() : *impl.free_ids.begin();
  const size_t with_data =
      data == InstanceData() ? impl.instance_data.size() : std::max(impl.instance_data.size(), id + 1);
  FARFIELD_TRY(impl.count_instances(instances.size() + is_new, with_data));

  impl.instance_data.resize(with_data);
  if (id < with_data) impl.instance_data[id] = data;
  const InstanceId added{static_cast<uint32_t>(id)};
  if (is_new) {
    instances.push_back(record);
    return added;
  }
  impl.free_ids.erase(impl.free_ids.begin());
  instances[id] = record;
  impl.geometry.set_hidden(added.value, false);
  impl.planner.note_moved(added.value);
  return added;
}

Result<void> Runtime::set_level_limits(InstanceId instance, const LevelLimits& limits) {
  FARFIELD_TRY(check_limits(limits));
  if (!impl_->has_instance(instance)) return no_such_instance(instance);
  impl_->geometry.instances[instance.value].limits = limits;
  return {};
}

Result<void> Runtime::set_level_limits(AssetId asset, const LevelLimits& limits) {
  FARFIELD_TRY(check_limits(limits));
  Impl& impl = *impl_;
  if (asset.value >= impl.levels.asset_count()) return no_such_asset(asset);
  impl.asset_limits.resize(impl.levels.asset_count());
  impl.asset_limits[asset.value] = limits;
  for (InstanceRecord& instance : impl.geometry.instances) {
    if (instance.asset == asset.value) instance.limits = limits;
  }
  return {};
}

Result<void> Runtime::Impl::place(uint32_t instance, const InstanceRecord& record,
                                  std::optional<InstanceMotion> motion) {
  const InstanceRecord former = geometry.instances[instance];
  std::optional<InstanceMotion> former_motion = geometry.motion(instance);
  geometry.instances[instance] = record;
  geometry.instances[instance].limits = former.limits;
  Result<void> is_placed = geometry.set_motion(instance, std::move(motion));
  if (is_placed) is_placed = count_instances();
  if (!is_placed) {
    geometry.instances[instance] = former;
    FARFIELD_TRY(geometry.set_motion(instance, std::move(former_motion)));
    return is_placed;
  }
  planner.note_moved(instance);
  return {};
}

Result<void> Runtime::move_instance(InstanceId instance, const glm::mat4x3& local_to_world) {
  Impl& impl = *impl_;
  if (!impl.has_instance(instance)) return no_such_instance(instance);
  const uint32_t asset = impl.geometry.instances[instance.value].asset;
  FARFIELD_TRY_LET(const auto record, impl.make_record(asset, local_to_world));
  return impl.place(instance.value, record, std::nullopt);
}

Result<void> Runtime::move_instance(InstanceId instance, const std::vector<glm::mat4x3>& keys) {
  if (keys.size() == 1) return move_instance(instance, keys.front());
  Impl& impl = *impl_;
  if (!impl.has_instance(instance)) return no_such_instance(instance);
  const uint32_t asset = impl.geometry.instances[instance.value].asset;
  std::vector<mat4x3> asset_keys;
  float stretch = 0.0f;
  for (const mat4x3& key : keys) {
    asset_keys.push_back(impl.asset_to_world(asset, key));
    stretch = std::max(stretch, largest_stretch(key));
  }
  FARFIELD_TRY_LET(auto motion, InstanceMotion::make(asset_keys));
  FARFIELD_TRY_LET(auto record, impl.make_record(asset, keys.front()));
  record.footprint.world_to_r0 = impl.options.pixel_error / stretch;  // of the key that shows it largest
  return impl.place(instance.value, record, std::move(motion));
}

Result<void> Runtime::set_visible(InstanceId instance, bool is_visible) {
  Impl& impl = *impl_;
  if (!impl.has_instance(instance)) return no_such_instance(instance);
  impl.geometry.set_hidden(instance.value, !is_visible);
  impl.planner.note_moved(instance.value);
  return {};
}

Result<void> Runtime::remove_instance(InstanceId instance) {
  Impl& impl = *impl_;
  if (!impl.has_instance(instance)) return no_such_instance(instance);
  FARFIELD_TRY(impl.geometry.set_motion(instance.value, std::nullopt));
  FARFIELD_TRY(impl.count_instances());
  impl.geometry.set_hidden(instance.value, true);
  impl.free_ids.insert(instance.value);
  if (instance.value < impl.instance_data.size()) impl.instance_data[instance.value] = {};
  return {};
}

InstanceData Runtime::instance_data(const Interaction& interaction) const {
  const std::vector<InstanceData>& data = impl_->instance_data;
  return interaction.instance < data.size() ? data[interaction.instance] : InstanceData();
}

void Runtime::set_cameras(std::vector<TessellationCamera> cameras) { impl_->planner.set_cameras(std::move(cameras)); }

Result<PlanSummary> Runtime::plan_frame() { return impl_->planner.plan(impl_->levels); }

void Runtime::prefetch() { impl_->planner.prefetch(impl_->levels); }

void Runtime::look_ahead(const std::vector<TessellationCamera>& next_cameras) {
  impl_->planner.look_ahead(impl_->levels, next_cameras);
}

Result<unsigned> Runtime::attach(RTCScene scene) { return impl_->host.attach(scene, impl_->geometry); }

unsigned Runtime::geometry_id() const { return impl_->host.geometry_id(); }

Interaction Runtime::interaction(const RTCRayHit& ray_hit, const RayContext& context) const {
  if (!is_of_ray_context(context.embree)) {
    impl_->messages.report_once(impl_->said_flags, Severity::Error,
                                "interaction() with a RayContext whose embree.flags were overwritten, perhaps by "
                                "rtcInitIntersectContext: nothing is known of its hits; they are black");
    return {};
  }
  const bool is_of_this_ray = context.hit.instance == ray_hit.hit.primID;
  const HitLevels levels = is_of_this_ray ? impl_->levels_of(context.hit) : HitLevels();
  if (!levels.level) {
    impl_->messages.report_once(impl_->said_stale_hit, Severity::Error,
                                "interaction() of what is no hit of ours since the last plan_frame(), or of another "
                                "query than its context; it is black");
    return {};
  }
  std::optional<InstanceRecord> moved;
  const InstanceRecord& instance = impl_->geometry.record_at(context.hit.instance, ray_hit.ray.time, moved);
  return make_interaction(levels, instance, ray_hit, context.hit);
}

AssetId Runtime::asset_of(InstanceId instance) const {
  return {impl_->has_instance(instance) ? impl_->geometry.instances[instance.value].asset : kNoInstance};
}

std::vector<LevelRecord> Runtime::level_stats(AssetId asset) const {
  return asset.value < impl_->levels.asset_count() ? impl_->levels.level_stats(asset.value)
                                                   : std::vector<LevelRecord>();
}

std::vector<RayVisit> Runtime::explain(const RTCRay& ray, const RayContext& context) const {
  return explain_ray(impl_->geometry, ray, context);
}

Stats Runtime::stats() const {
  const ResidencyStats levels = impl_->levels.stats();
  Stats stats;
  stats.accounted_bytes = levels.accounted_bytes;
  stats.peak_accounted_bytes = levels.peak_accounted_bytes;
  stats.levels_loaded = levels.loads;
  stats.levels_resident = levels.ready_items;
  stats.levels_released = levels.releases;
  stats.fallbacks = impl_->levels.fallbacks();
  stats.load_seconds = levels.load_seconds;
  stats.wait_seconds = levels.wait_seconds;
  return stats;
}

}  // namespace farfield
