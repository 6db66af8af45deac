// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/render_session.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>

#include "base/bytes.h"
#include "base/parallel.h"
#include "base/process_memory.h"
#include "base/process_time.h"
#include "base/result.h"
#include "base/stopwatch.h"
#include "path_tracer/pixel_look.h"

namespace farfield {

namespace {

// Whether instances would take so much of the budget that levels are worth more than fast rays among them.
bool needs_small_scene(size_t instances, uint64_t budget_bytes) {
  constexpr uint64_t kRecordBytes = 64, kLargestShare = 4;
  return instances * (kRecordBytes + kSceneBytesPerInstance) > budget_bytes / kLargestShare;
}

RuntimeOptions runtime_options(const RenderOptions& options, bool has_small_scene) {
  RuntimeOptions runtime;
  if (has_small_scene) runtime.scene_bytes_per_instance = kSmallSceneBytesPerInstance;
  runtime.budget_bytes = options.budget_bytes;
  runtime.blend = options.blend;
  runtime.blend_window = options.blend_window;
  runtime.pixel_error = options.pixel_error;
  if (options.full_detail) runtime.forced_lambda = 0.0f;
  runtime.messages = [message = options.message, warning = options.warning](Severity severity,
                                                                            const std::string& text) {
    const auto& sink = severity == Severity::Info ? message : warning;
    if (sink) sink(text);
  };
  return runtime;
}

std::vector<TessellationCamera> tessellation(std::span<const Camera> camera, const RenderOptions& options) {
  std::vector<TessellationCamera> keys;
  for (const Camera& key : camera) {
    keys.push_back(key.tessellation());
    keys.back().off_screen_scale = options.off_screen_scale;
  }
  return keys;
}

// The runtime knows what the assets and instances need that it was given so far; here all are known.
Error with_number_for_all(const Error& error, const RenderOptions& options,
                          std::span<const std::filesystem::path> folders, std::span<const GltfInstance> instances) {
  if (error.code != ErrorCode::OutOfBudget) return error;
  std::vector<std::string> shown;
  for (const std::filesystem::path& folder : folders)
    if (!folder.empty()) shown.push_back(folder.string());
  const auto count = static_cast<uint64_t>(
      std::ranges::count_if(instances, [&](const GltfInstance& instance) { return !folders[instance.mesh].empty(); }));
  auto least = Runtime::least_budget(shown, count, runtime_options(options, true));
  if (least && !needs_small_scene(instances.size(), *least))  // so much budget that the scene is not built small
    least = Runtime::least_budget(shown, count, runtime_options(options, false));
  if (!least) return error;
  return {
      ErrorCode::OutOfBudget,
      fmt::format("the budget of {} is too small for {} assets and {} instances: raise it to {} ({} bytes) at least",
                  format_bytes(options.budget_bytes), shown.size(), count, format_bytes(*least), *least),
      error.warnings};
}

}  // namespace

Result<std::unique_ptr<RenderSession>> RenderSession::open(EmbreeDeviceRef device, const RenderOptions& options,
                                                           std::span<const std::filesystem::path> folders,
                                                           std::span<const GltfInstance> instances,
                                                           const MaterialNames& names) {
  std::unique_ptr<RenderSession> session(new RenderSession);
  const bool is_small = needs_small_scene(instances.size(), options.budget_bytes);
  FARFIELD_TRY_LET(auto runtime, Runtime::create(device, runtime_options(options, is_small)));
  session->runtime_ = std::move(runtime);
  if (auto filled = session->fill(device, folders, instances, names, is_small); !filled)
    return tl::unexpected(with_number_for_all(filled.error(), options, folders, instances));
  return session;
}

Result<void> RenderSession::fill(EmbreeDeviceRef device, std::span<const std::filesystem::path> folders,
                                 std::span<const GltfInstance> instances, const MaterialNames& names, bool is_small) {
  ids_ = SceneIds(names);
  std::vector<AssetId> assets(folders.size());
  for (size_t mesh = 0; mesh < folders.size(); ++mesh) {
    is_shown_.push_back(!folders[mesh].empty());
    if (!is_shown_[mesh]) continue;
    FARFIELD_TRY_LET(assets[mesh], runtime_->open_asset(folders[mesh].string()));
    assets_.push_back(assets[mesh]);
  }
  for (const GltfInstance& instance : instances) {
    if (!is_shown_[instance.mesh]) continue;
    FARFIELD_TRY(runtime_->add_instance(assets[instance.mesh], instance.to_world, instance.data));
    if (!names.empty()) ids_.add_instance(instance);
  }
  FARFIELD_TRY_LET(scene_, make_scene(device, *runtime_, is_small));
  return {};
}

Result<void> RenderSession::move(std::span<const std::vector<GltfInstance>> keys) {
  InstanceId id{0};
  for (size_t i = 0; i < keys.front().size(); ++i) {
    if (!is_shown_[keys.front()[i].mesh]) continue;
    std::vector<mat4x3> places;
    for (const std::vector<GltfInstance>& instances : keys) places.push_back(instances[i].to_world);
    const bool is_still = std::ranges::count(places, places.front()) == std::ssize(places);
    if (is_still) places.resize(1);
    FARFIELD_TRY(runtime_->move_instance(id, places));
    ++id.value;
  }
  FARFIELD_TRY(runtime_->attach(scene_.get()));
  commit_scene(scene_.get());
  return {};
}

Result<PlanSummary> RenderSession::plan(std::span<const Camera> camera, const RenderOptions& options) {
  runtime_->set_cameras(tessellation(camera, options));
  return runtime_->plan_frame();
}

std::vector<std::vector<LevelRecord>> RenderSession::level_stats() const {
  std::vector<std::vector<LevelRecord>> stats;
  for (const AssetId asset : assets_) stats.push_back(runtime_->level_stats(asset));
  return stats;
}

/// What happened to levels since `before`.
std::vector<std::vector<LevelUse>> RenderSession::level_use(const std::vector<std::vector<LevelRecord>>& before,
                                                            const LevelHits& hits) const {
  std::vector<std::vector<LevelUse>> uses(assets_.size());
  for (size_t i = 0; i < assets_.size(); ++i) {
    const std::vector<LevelRecord> after = runtime_->level_stats(assets_[i]);
    const std::vector<LevelInfo>& levels = runtime_->levels(assets_[i]);
    for (uint32_t slot = 0; slot < after.size(); ++slot) {
      const LevelRecord &then = before[i][slot], &now = after[slot];
      const LevelUse use{levels[slot].level,     hits.of(assets_[i].value, slot),
                         now.loads - then.loads, now.load_seconds - then.load_seconds,
                         now.resident_bytes,     now.fallbacks - then.fallbacks};
      if (use.hits + use.loads + use.resident_bytes + use.served_coarser > 0) uses[i].push_back(use);
    }
  }
  return uses;
}

Result<void> RenderSession::explain(const Camera& camera, const RenderOptions& options,
                                    std::span<const std::string> names, std::span<const GltfInstance> instances,
                                    PixelReport& report) {
  FARFIELD_TRY_LET(const PlanSummary plan, this->plan({&camera, 1}, options));
  report.budget_bytes = options.budget_bytes;
  report.planned_bytes = plan.planned_bytes;
  report.asked_bytes = plan.asked_bytes;

  PixelNames by_id;
  by_id.assets.resize(plan.levels_given_up.size());
  for (size_t i = 0; i < assets_.size(); ++i) by_id.assets[assets_[i].value] = names[i];
  for (const GltfInstance& instance : instances)
    if (is_shown_[instance.mesh]) by_id.objects.push_back(object_name(instance));
  look_at_pixel({scene_.get(), runtime_.get()}, camera, plan, by_id, report);
  return {};
}

Result<FrameReport> RenderSession::render(const FrameCameras& cameras, const Lights& lights,
                                          const RenderOptions& options, Film& film, const Job& job) {
  const Stopwatch watch;
  const double cpu_start = process_cpu_seconds();
  const Stats before = runtime_->stats();
  const std::vector<std::vector<LevelRecord>> levels_before = level_stats();
  FARFIELD_TRY_LET(auto plan, this->plan(cameras.now, options));
  const Stopwatch prefetch_watch;
  runtime_->prefetch();
  const double prefetch_seconds = prefetch_watch.seconds();
  const double waited_before = runtime_->stats().wait_seconds;
  malloc_trim(0);  // nor is what moving and planning left there
  runtime_->look_ahead(tessellation(cameras.next, options));

  const TraceScene scene{scene_.get(), runtime_.get(), &lights, &ids_};
  FARFIELD_TRY_LET(const auto traced, path_trace(scene, cameras.now, options.trace, film, job));

  const Stats after = runtime_->stats();
  FrameReport report;
  report.seconds = watch.seconds();
  report.cpu_seconds = process_cpu_seconds() - cpu_start;
  report.load_seconds = after.load_seconds - before.load_seconds;
  report.stall_seconds = prefetch_seconds + (after.wait_seconds - waited_before) / thread_count();
  report.accounted_bytes = after.accounted_bytes;
  report.rss_bytes = resident_set_bytes();
  report.levels_loaded = after.levels_loaded - before.levels_loaded;
  report.fallbacks = after.fallbacks - before.fallbacks;
  report.rays = traced.rays;
  report.invalid_samples = traced.invalid_samples;
  report.bias = plan.bias;
  report.asked_bytes = plan.asked_bytes;
  report.morphs = plan.morphs;
  report.morphs_given_up = plan.morphs_given_up;
  report.levels = level_use(levels_before, traced.hits);
  report.finest_level = std::move(plan.finest_level);
  report.levels_given_up = std::move(plan.levels_given_up);
  return report;
}

}  // namespace farfield
