// SPDX-License-Identifier: Apache-2.0
// Where the rooms meet: assets (cache) become things that rays see (bvh), levels are planned (lodselect) and loaded
// within the budget (cache/residency).
//
// What the budget pays for, besides the levels: instance records, the host's BVH over them, the tables of open assets.
// Between frames plan_frame() first gives back what the new plan does not allow, so what it does allow always fits.
#include "farfield/runtime.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <mutex>

#include "base/check.h"
#include "base/parallel.h"
#include "base/result.h"
#include "bvh/bvh_device.h"
#include "bvh/instance_geometry.h"
#include "cache/loader_thread.h"
#include "cache/residency.h"
#include "lodselect/footprint.h"
#include "lodselect/planner.h"
#include "runtime/interaction_model.h"
#include "runtime/open_asset.h"

namespace farfield {

namespace {

// What the host's scene takes for each primitive of our user geometry [measured: RSS of a MEDIUM top-level BVH].
constexpr uint64_t kHostBytesPerInstance = 136;
// Device, geometry, loader, tables of the runtime itself, and what malloc keeps of small blocks.
constexpr uint64_t kRuntimeBytes = 256 * 1024;
// A camera footprint's share of an image: no instance counts for more pixels than a frame has.
constexpr double kLargestPixelCount = 1e7;
// The allocator is asked to give memory back once this share of the budget was freed. Not after every load: in a host
// with a large heap that costs milliseconds.
constexpr uint64_t kTrimShare = 64;

Result<void> check_options(const RuntimeOptions& options) {
  const auto invalid = [](const char* what) { return make_error(ErrorCode::InvalidArgument, what); };
  if (options.budget_bytes == 0) return invalid("the budget is 0 bytes; give RuntimeOptions::budget_bytes a size");
  if (!(options.lod_scale > 0.0f) || !std::isfinite(options.lod_scale)) return invalid("lod_scale must be positive");
  if (options.forced_lambda && !std::isfinite(*options.forced_lambda)) return invalid("forced_lambda must be finite");
  return {};
}

bool is_scene_of(RTCScene scene, RTCDevice device) {
  const RTCDevice of_scene = rtcGetSceneDevice(scene);  // retained for us
  rtcReleaseDevice(of_scene);
  return of_scene == device;
}

/// M after a translation by `origin`, in double: both may be far from zero and cancel.
mat4x3 with_origin(const mat4x3& m, const dvec3& origin) {
  mat4x3 result = m;
  result[3] = vec3(dvec3(m[3]) + glm::dmat3(dvec3(m[0]), dvec3(m[1]), dvec3(m[2])) * origin);
  return result;
}

}  // namespace

struct Runtime::Impl final : LevelSource {
  Impl(RTCDevice host, const RuntimeOptions& runtime_options, std::unique_ptr<BvhDevice> level_device);
  ~Impl() override;

  // Rays
  const TracedLevel* serve(uint32_t asset, uint32_t slot) override;

  // Between frames
  Result<AssetId> open(const std::filesystem::path& folder);
  Result<void> load_root(OpenAsset& asset);
  Result<Plan> plan_roots(const OpenAsset& newcomer) const;
  void update_footprints(const std::vector<FootprintCamera>& of_cameras);
  std::vector<PlanAsset> plan_assets() const;
  PlanAsset plan_asset(const OpenAsset& asset) const;
  void apply(const Plan& plan);
  void prefetch();
  float wanted_lambda(const InstanceRecord& instance) const;
  uint64_t fixed_bytes() const;

  // Memory and messages
  void count_freed(uint64_t bytes);
  void report(Severity severity, const std::string& message);
  void report_broken(size_t item, const Error& error);

  struct ItemOwner {
    OpenAsset* asset;
    uint32_t slot;
  };

  const RuntimeOptions options;
  std::mutex sink_mutex;  ///< one message at a time
  std::vector<FootprintCamera> cameras;
  std::vector<FootprintCamera> planned_cameras;  ///< those of the plan in force
  RTCDevice host_device;
  std::unique_ptr<BvhDevice> device;
  std::vector<std::unique_ptr<OpenAsset>> assets;
  std::vector<std::unique_ptr<OpenAsset>> refused;  ///< did not open; items of `levels` refer to them
  std::vector<ItemOwner> item_owners;
  std::optional<Error> opening_error;  ///< why the root of the asset being opened did not load
  const OpenAsset* opening = nullptr;
  ResidentSet levels;
  InstanceGeometry geometry{*this};
  RTCGeometry handle = nullptr;  ///< null until attach()
  RTCScene scene = nullptr;      ///< that `handle` is attached to; retained
  unsigned geometry_id = RTC_INVALID_GEOMETRY_ID;
  std::atomic<uint64_t> fallbacks{0};    ///< relaxed: a counter
  std::atomic<uint64_t> freed_bytes{0};  ///< since the last malloc_trim; relaxed: a counter
  LoaderThread loader;                   ///< last: stops before anything else goes
};

Runtime::Impl::Impl(RTCDevice host, const RuntimeOptions& runtime_options, std::unique_ptr<BvhDevice> level_device)
    : options(runtime_options),
      host_device(host),
      device(std::move(level_device)),
      levels(options.budget_bytes, [this](size_t item, const Error& error) { report_broken(item, error); }),
      loader([this](size_t item) { levels.acquire(item); }) {
  rtcRetainDevice(host_device);
  geometry.forced_lambda = options.forced_lambda;
}

Runtime::Impl::~Impl() {
  if (handle) rtcReleaseGeometry(handle);
  if (scene) rtcReleaseScene(scene);
  rtcReleaseDevice(host_device);
}

// --- Rays ------------------------------------------------------------------------------------------------------------

const TracedLevel* Runtime::Impl::serve(uint32_t asset_index, uint32_t slot) {
  OpenAsset& asset = *assets[asset_index];
  const bool wait = options.residency == Residency::Wait;
  bool was_requested = false;
  for (uint32_t served = slot; served < asset.traced.slot_count(); ++served) {
    const size_t item = asset.items[served];
    const Resident* resident = wait ? levels.acquire(item) : levels.try_acquire(item);
    if (resident) {
      const TracedLevel* level = static_cast<const LoadedLevel*>(resident)->traced.get();
      asset.traced.loaded[served].store(level, std::memory_order_release);
      if (served != slot) fallbacks.fetch_add(1, std::memory_order_relaxed);
      return level;
    }
    if (!wait && !was_requested && levels.state(item) == ItemState::Empty) {
      loader.request(item);
      was_requested = true;
    }
  }
  return nullptr;
}

// --- Assets ----------------------------------------------------------------------------------------------------------

Result<AssetId> Runtime::Impl::open(const std::filesystem::path& folder) {
  for (uint32_t i = 0; i < assets.size(); ++i) {
    if (assets[i]->folder == folder) return AssetId{i};
  }
  loader.forget();  // its thread must not meet tables that grow, nor take the room of the root
  FARFIELD_TRY_LET(auto asset, read_asset(folder));
  if (auto root = load_root(*asset); !root) {
    refused.push_back(std::move(asset));
    return tl::unexpected(root.error());
  }
  asset->traced.finest_slot = asset->traced.slot_count() - 1;  // until a plan says otherwise
  geometry.assets.push_back(&asset->traced);
  assets.push_back(std::move(asset));
  levels.set_other_bytes(fixed_bytes());
  return AssetId{static_cast<uint32_t>(assets.size() - 1)};
}

Result<void> Runtime::Impl::load_root(OpenAsset& asset) {
  for (uint32_t slot = 0; slot < asset.traced.slot_count(); ++slot) {
    ResidencyItem item = make_level_item(asset, slot, *device);
    item.load = [this, load = std::move(item.load)] {
      Result<LoadedItem> loaded = load();
      if (loaded) count_freed(loaded->build_peak_bytes);
      return loaded;
    };
    asset.items.push_back(levels.add(std::move(item)));
    item_owners.push_back({&asset, slot});
  }
  loader.resize(levels.size());

  // Roots come first: what an earlier plan has loaded beside them may be in the way, and the next plan decides anew.
  FARFIELD_TRY_LET(const auto plan, plan_roots(asset));
  const size_t root = asset.items.back();
  const uint64_t needed = levels.resident_bytes(root) + levels.build_peak_bytes(root) + asset.table_bytes();
  if (levels.stats().accounted_bytes + needed > options.budget_bytes) apply(plan);

  opening = &asset;
  opening_error.reset();
  const bool is_loaded = levels.acquire(root) != nullptr;
  opening = nullptr;
  if (!is_loaded) return tl::unexpected(*opening_error);
  return {};
}

/// The plan in which all assets have nothing but their roots.
Result<Plan> Runtime::Impl::plan_roots(const OpenAsset& newcomer) const {
  std::vector<PlanAsset> wanted;
  for (const auto& asset : assets) wanted.push_back(plan_asset(*asset));
  wanted.push_back(plan_asset(newcomer));
  for (PlanAsset& asset : wanted) asset.wanted_lambda = asset.lambda.back();
  auto plan = plan_levels(wanted, options.budget_bytes, fixed_bytes() + newcomer.table_bytes());
  if (plan) plan->finest.pop_back();  // apply() knows the newcomer not yet
  return plan;
}

// --- Plans -----------------------------------------------------------------------------------------------------------

void Runtime::Impl::update_footprints(const std::vector<FootprintCamera>& of_cameras) {
  constexpr size_t kGrain = 1024;
  parallel_for(geometry.instances.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      InstanceRecord& instance = geometry.instances[i];
      const Box3 bounds = instance_bounds(instance, *geometry.assets[instance.asset]);
      instance.footprint.camera_footprint = of_cameras.empty() ? 0.0f : finest_footprint(of_cameras, bounds);
    }
  });
}

/// The lambda that the cameras ask for on an instance, at least 0, not clamped to what there is.
float Runtime::Impl::wanted_lambda(const InstanceRecord& instance) const {
  if (options.forced_lambda) return std::max(0.0f, *options.forced_lambda);
  const InstanceFootprint& footprint = instance.footprint;
  return lambda_of_footprint(footprint.camera_footprint * footprint.world_to_r0,
                             geometry.assets[instance.asset]->base_resolution, std::numeric_limits<int>::max());
}

PlanAsset Runtime::Impl::plan_asset(const OpenAsset& asset) const {
  PlanAsset wanted;
  for (const size_t item : asset.items) {
    const bool is_lost = levels.state(item) == ItemState::Broken;  // a coarser one serves: it takes nothing
    wanted.resident_bytes.push_back(is_lost ? 0 : levels.resident_bytes(item));
    wanted.build_peak_bytes.push_back(is_lost ? 0 : levels.build_peak_bytes(item));
  }
  wanted.lambda = asset.traced.level_numbers;
  wanted.wanted_lambda = wanted.lambda.back();  // if it has no instances
  wanted.pixels = 0.0;
  return wanted;
}

std::vector<PlanAsset> Runtime::Impl::plan_assets() const {
  std::vector<PlanAsset> wanted;
  for (const auto& asset : assets) wanted.push_back(plan_asset(*asset));
  for (const InstanceRecord& instance : geometry.instances) {
    PlanAsset& asset = wanted[instance.asset];
    asset.wanted_lambda = std::min(asset.wanted_lambda, wanted_lambda(instance));
    // The longest side of the world, in pixels, squared.
    const double diagonal = glm::length(geometry.assets[instance.asset]->bounds.size());
    const double pixel = instance.footprint.camera_footprint * instance.footprint.world_to_r0;
    const double across = pixel > 0.0 ? options.lod_scale * diagonal / pixel : kLargestPixelCount;
    asset.pixels += std::min(across * across, kLargestPixelCount);
  }
  return wanted;
}

void Runtime::Impl::apply(const Plan& plan) {
  loader.forget();
  std::vector<size_t> dropped;
  for (size_t i = 0; i < plan.finest.size(); ++i) {
    OpenAsset& asset = *assets[i];
    asset.traced.finest_slot = plan.finest[i];
    for (uint32_t slot = 0; slot < asset.traced.slot_count(); ++slot) {
      const bool is_refused = levels.state(asset.items[slot]) == ItemState::Refused;  // this plan may have room for it
      if (slot < plan.finest[i] || is_refused) {
        asset.traced.loaded[slot].store(nullptr, std::memory_order_relaxed);  // no ray in flight
        dropped.push_back(asset.items[slot]);
      }
    }
  }
  const uint64_t before = levels.stats().accounted_bytes;
  levels.release(dropped);
  count_freed(before - levels.stats().accounted_bytes);
  levels.set_other_bytes(fixed_bytes());
}

void Runtime::Impl::prefetch() {
  std::vector<std::vector<bool>> is_needed(assets.size());
  for (size_t i = 0; i < assets.size(); ++i) is_needed[i].resize(assets[i]->traced.slot_count());
  for (const InstanceRecord& instance : geometry.instances) {
    const SlotBlend slots = split_slots(*geometry.assets[instance.asset], wanted_lambda(instance));
    is_needed[instance.asset][slots.slot] = true;
    if (slots.blend > 0.0f) is_needed[instance.asset][slots.slot + 1] = true;
  }
  for (size_t i = 0; i < assets.size(); ++i) {
    for (size_t slot = is_needed[i].size(); slot-- > 0;) {  // coarse ones first: they are what others fall back to
      if (!is_needed[i][slot]) continue;
      const size_t item = assets[i]->items[slot];
      if (options.residency == Residency::Wait) {
        levels.acquire(item);
      } else {
        loader.request(item);
      }
    }
  }
}

uint64_t Runtime::Impl::fixed_bytes() const {
  uint64_t bytes = kRuntimeBytes + geometry.instances.capacity() * sizeof(InstanceRecord) +
                   geometry.instances.size() * kHostBytesPerInstance;
  for (const auto& asset : assets) bytes += asset->table_bytes();
  return bytes;
}

// --- Memory and messages ---------------------------------------------------------------------------------------------

/// Builds and releases leave holes in the heap, which `ps` still counts.
void Runtime::Impl::count_freed(uint64_t bytes) {
  const uint64_t freed = freed_bytes.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  if (freed < options.budget_bytes / kTrimShare) return;
  freed_bytes.store(0, std::memory_order_relaxed);
  malloc_trim(0);
}

void Runtime::Impl::report(Severity severity, const std::string& message) {
  if (!options.messages) return;
  const std::lock_guard lock(sink_mutex);
  options.messages(severity, message);
}

void Runtime::Impl::report_broken(size_t item, const Error& error) {
  const ItemOwner& owner = item_owners[item];
  if (owner.asset == opening) {
    opening_error = error;  // open_asset() returns it
    return;
  }
  report(error.code == ErrorCode::OutOfBudget ? Severity::Warning : Severity::Error,
         fmt::format("{}: level {} is left out, a coarser one serves in its place: {}", owner.asset->name,
                     owner.asset->levels[owner.slot].level, error.message));
}

// --- The public face -------------------------------------------------------------------------------------------------

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

Result<AssetId> Runtime::open_asset(const std::string& folder) {
  std::error_code error;
  const std::filesystem::path canonical = std::filesystem::canonical(folder, error);
  if (error) {
    return make_error(ErrorCode::NotFound, fmt::format("cannot open the asset {}: {}", folder, error.message()));
  }
  return impl_->open(canonical);
}

const std::vector<LevelInfo>& Runtime::levels(AssetId asset) const {
  FARFIELD_CHECK(asset.value < impl_->assets.size());
  return impl_->assets[asset.value]->levels;
}

void Runtime::bounds(AssetId asset, glm::vec3& lower, glm::vec3& upper) const {
  FARFIELD_CHECK(asset.value < impl_->assets.size());
  const Box3& box = impl_->assets[asset.value]->bounds_source;
  lower = box.lower;
  upper = box.upper;
}

Result<InstanceId> Runtime::add_instance(AssetId asset, const glm::mat4x3& local_to_world) {
  if (asset.value >= impl_->assets.size()) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("there is no asset {}", asset.value));
  }
  std::vector<InstanceRecord>& instances = impl_->geometry.instances;
  if (instances.size() >= kNoInstance) return make_error(ErrorCode::InvalidArgument, "too many instances");
  FARFIELD_TRY_LET(auto record,
                   make_instance(asset.value, with_origin(local_to_world, impl_->assets[asset.value]->origin)));
  record.footprint.world_to_r0 = impl_->options.lod_scale / largest_stretch(local_to_world);
  instances.push_back(record);
  return InstanceId{static_cast<uint32_t>(instances.size() - 1)};
}

void Runtime::set_cameras(std::vector<TessellationCamera> cameras) {
  impl_->cameras.clear();
  for (const TessellationCamera& camera : cameras) {
    impl_->cameras.push_back({camera.position, camera.pixel_width, camera.pixel_spread});
  }
}

Result<PlanSummary> Runtime::plan_frame() {
  Impl& impl = *impl_;
  if (impl.cameras.empty() && !impl.options.forced_lambda) {
    return make_error(ErrorCode::InvalidArgument, "plan_frame() needs a camera: call set_cameras() before");
  }
  impl.loader.forget();  // plan with sizes that no longer change
  impl.update_footprints(impl.cameras);
  const auto plan = plan_levels(impl.plan_assets(), impl.options.budget_bytes, impl.fixed_bytes());
  if (!plan) {
    impl.update_footprints(impl.planned_cameras);  // the former plan stays
    return tl::unexpected(plan.error());
  }
  impl.planned_cameras = impl.cameras;
  impl.apply(*plan);

  PlanSummary summary;
  for (size_t i = 0; i < impl.assets.size(); ++i) {
    summary.finest_level.push_back(impl.assets[i]->levels[plan->finest[i]].level);
  }
  summary.planned_bytes = plan->resident_bytes + plan->build_peak_bytes + impl.fixed_bytes();
  summary.bias = plan->bias;
  return summary;
}

void Runtime::prefetch() { impl_->prefetch(); }

Result<unsigned> Runtime::attach(RTCScene scene) {
  Impl& impl = *impl_;
  if (!scene) return make_error(ErrorCode::InvalidArgument, "attach() needs a scene");
  if (!is_scene_of(scene, impl.host_device)) {
    return make_error(ErrorCode::InvalidArgument, "attach() needs a scene of the device that create() was given");
  }
  if (!impl.handle) {
    impl.handle = impl.geometry.create(impl.host_device);
  } else {
    impl.geometry.update(impl.handle);
  }
  if (scene == impl.scene) return impl.geometry_id;

  const unsigned id = rtcAttachGeometry(scene, impl.handle);
  if (id == RTC_INVALID_GEOMETRY_ID) {
    return make_error(ErrorCode::Io, fmt::format("Embree refuses the geometry (error {})",
                                                 static_cast<int>(rtcGetDeviceError(impl.host_device))));
  }
  rtcRetainScene(scene);  // so that its address stays its own
  if (impl.scene) {
    rtcDetachGeometry(impl.scene, impl.geometry_id);
    rtcReleaseScene(impl.scene);
  }
  impl.scene = scene;
  impl.geometry_id = id;
  return id;
}

unsigned Runtime::geometry_id() const { return impl_->geometry_id; }

Interaction Runtime::interaction(const RTCRayHit& ray_hit, const RayContext& context) const {
  const HitRecord& hit = context.hit;
  FARFIELD_CHECK(hit.instance < impl_->geometry.instances.size());
  const InstanceRecord& instance = impl_->geometry.instances[hit.instance];
  const TracedAsset& asset = *impl_->geometry.assets[instance.asset];
  const TracedLevel* level = asset.loaded[hit.level_slot].load(std::memory_order_acquire);
  FARFIELD_CHECK(level != nullptr);  // it was when the ray hit it: is the hit from before plan_frame()?
  return make_interaction(*level, instance, ray_hit, hit);
}

Stats Runtime::stats() const {
  const ResidencyStats levels = impl_->levels.stats();
  Stats stats;
  stats.accounted_bytes = levels.accounted_bytes;
  stats.peak_accounted_bytes = levels.peak_accounted_bytes;
  stats.levels_loaded = levels.loads;
  stats.levels_resident = levels.ready_items;
  stats.levels_released = levels.releases;
  stats.fallbacks = impl_->fallbacks.load(std::memory_order_relaxed);
  stats.load_seconds = levels.load_seconds;
  return stats;
}

}  // namespace farfield
