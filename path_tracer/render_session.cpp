// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/render_session.h"

#include <malloc.h>

#include <chrono>

#include "base/process_memory.h"
#include "base/process_time.h"
#include "base/result.h"

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

}  // namespace

Result<std::unique_ptr<RenderSession>> RenderSession::open(EmbreeDeviceRef device, const RenderOptions& options,
                                                           std::span<const std::filesystem::path> folders,
                                                           std::span<const GltfInstance> instances,
                                                           const MaterialNames& names) {
  std::unique_ptr<RenderSession> session(new RenderSession);
  const bool is_small = needs_small_scene(instances.size(), options.budget_bytes);
  FARFIELD_TRY_LET(auto runtime, Runtime::create(device, runtime_options(options, is_small)));
  session->runtime_ = std::move(runtime);
  session->ids_ = SceneIds(names);

  std::vector<AssetId> assets(folders.size());
  for (size_t mesh = 0; mesh < folders.size(); ++mesh) {
    if (folders[mesh].empty()) continue;
    FARFIELD_TRY_LET(const auto asset, session->runtime_->open_asset(folders[mesh].string()));
    assets[mesh] = asset;
  }
  for (const GltfInstance& instance : instances) {
    if (folders[instance.mesh].empty()) continue;
    if (auto added = session->runtime_->add_instance(assets[instance.mesh], instance.to_world, instance.data); !added)
      return tl::unexpected(added.error());
    if (!names.empty()) session->ids_.add_instance(instance);
  }
  FARFIELD_TRY_LET(auto scene, make_scene(device, *session->runtime_, is_small));
  session->scene_ = std::move(scene);
  return session;
}

Result<FrameReport> RenderSession::render(const Camera& camera, const Lights& lights, const RenderOptions& options,
                                          Film& film, const Job& job) {
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = process_cpu_seconds();
  const Stats before = runtime_->stats();
  runtime_->set_cameras({camera.tessellation()});
  FARFIELD_TRY_LET(auto plan, runtime_->plan_frame());
  runtime_->prefetch();
  malloc_trim(0);  // what writing the last frame left in the heap is not the assets'

  const TraceScene scene{scene_.get(), runtime_.get(), &lights, &ids_};
  FARFIELD_TRY_LET(const auto traced, path_trace(scene, camera, options.trace, film, job));

  const Stats after = runtime_->stats();
  FrameReport report;
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report.cpu_seconds = process_cpu_seconds() - cpu_start;
  report.load_seconds = after.load_seconds - before.load_seconds;
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
  report.finest_level = std::move(plan.finest_level);
  report.levels_given_up = std::move(plan.levels_given_up);
  return report;
}

}  // namespace farfield
