// SPDX-License-Identifier: Apache-2.0
// The public face. Assets and their levels: level_store. What the cameras ask for: frame_planner. The host's scene:
// host_scene. Shading: interaction.
#include "farfield/runtime.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

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

}  // namespace

struct Runtime::Impl {
  Impl(RTCDevice host_device, const RuntimeOptions& runtime_options, std::unique_ptr<BvhDevice> level_device)
      : options(runtime_options),
        messages(runtime_options.messages),
        levels(std::move(level_device), options, messages),
        planner(options, geometry),
        host(host_device) {
    geometry.forced_lambda = options.forced_lambda;
  }

  /// Tells the budget what the instances take. The room that the arrays have beyond was never touched: it is not
  /// resident.
  void count_instances() {
    levels.set_instance_bytes(geometry.instances.size() * (sizeof(InstanceRecord) + options.scene_bytes_per_instance) +
                              instance_data.size() * sizeof(InstanceData));
  }
  const TracedLevel* level_of(const HitRecord& hit) const;

  const RuntimeOptions options;
  Messages messages;
  LevelStore levels;
  InstanceGeometry geometry{levels};
  FramePlanner planner;
  HostScene host;
  std::vector<InstanceData> instance_data;  ///< per instance, up to the last one that has any
  std::atomic<bool> said_stale_hit{false};
};

/// The level that was hit; null if the record is not of a hit, or the level has gone since.
const TracedLevel* Runtime::Impl::level_of(const HitRecord& hit) const {
  if (hit.instance >= geometry.instances.size()) return nullptr;
  const TracedAsset& asset = *geometry.assets[geometry.instances[hit.instance].asset];
  if (hit.level_slot >= asset.slot_count()) return nullptr;
  const TracedLevel* level = asset.loaded[hit.level_slot].load(std::memory_order_acquire);
  return level && is_hit_of(*level, hit) ? level : nullptr;
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
  std::error_code error;
  const std::filesystem::path canonical = std::filesystem::canonical(folder, error);
  if (error) {
    return make_error(ErrorCode::NotFound, fmt::format("cannot open the asset {}: {}", folder, error.message()));
  }
  Impl& impl = *impl_;
  impl.count_instances();
  FARFIELD_TRY_LET(const uint32_t asset, impl.levels.open(canonical, std::move(materials)));
  if (asset == impl.geometry.assets.size()) impl.geometry.assets.push_back(&impl.levels.asset(asset).traced);
  return AssetId{asset};
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

Result<InstanceId> Runtime::add_instance(AssetId asset, const glm::mat4x3& local_to_world, const InstanceData& data) {
  if (asset.value >= impl_->levels.asset_count()) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("there is no asset {}", asset.value));
  }
  std::vector<InstanceRecord>& instances = impl_->geometry.instances;
  if (instances.size() >= kNoInstance) return make_error(ErrorCode::InvalidArgument, "too many instances");
  const OpenAsset& opened = impl_->levels.asset(asset.value);
  FARFIELD_TRY_LET(auto record,
                   make_instance(asset.value, with_origin(local_to_world, opened.origin, opened.rotation)));
  record.footprint.world_to_r0 = impl_->options.pixel_error / largest_stretch(local_to_world);
  instances.push_back(record);
  if (data != InstanceData()) {
    impl_->instance_data.resize(instances.size());
    impl_->instance_data.back() = data;
  }
  return InstanceId{static_cast<uint32_t>(instances.size() - 1)};
}

InstanceData Runtime::instance_data(const Interaction& interaction) const {
  const std::vector<InstanceData>& data = impl_->instance_data;
  return interaction.instance < data.size() ? data[interaction.instance] : InstanceData();
}

void Runtime::set_cameras(std::vector<TessellationCamera> cameras) { impl_->planner.set_cameras(std::move(cameras)); }

Result<PlanSummary> Runtime::plan_frame() {
  impl_->count_instances();
  return impl_->planner.plan(impl_->levels);
}

void Runtime::prefetch() { impl_->planner.prefetch(impl_->levels); }

Result<unsigned> Runtime::attach(RTCScene scene) { return impl_->host.attach(scene, impl_->geometry); }

unsigned Runtime::geometry_id() const { return impl_->host.geometry_id(); }

Interaction Runtime::interaction(const RTCRayHit& ray_hit, const RayContext& context) const {
  const TracedLevel* level = impl_->level_of(context.hit);
  if (!level) {
    impl_->messages.report_once(impl_->said_stale_hit, Severity::Error,
                                "interaction() of what is no hit of ours since the last plan_frame(); it is black");
    return {};
  }
  return make_interaction(*level, impl_->geometry.instances[context.hit.instance], ray_hit, context.hit);
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
  return stats;
}

}  // namespace farfield
