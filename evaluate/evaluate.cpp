// SPDX-License-Identifier: Apache-2.0
#include "evaluate/evaluate.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>

#include "bake/bake.h"
#include "base/hash.h"
#include "base/result.h"
#include "base/temporary_file.h"
#include "evaluate/figure_text.h"
#include "evaluate/pictures.h"
#include "evaluate/plan.h"
#include "evaluate/sheet.h"
#include "path_tracer/asset_view.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// Imports the source anew into an asset of level 0 only, which the path tracer then renders like any other.
Result<Manifest> bake_source(const EvaluateOptions& options, const Manifest& asset, const fs::path& folder) {
  BakeOptions bake_options;
  bake_options.source_only = true;
  // A cage becomes just the faces of the asset's own level 0.
  const uint32_t grid = asset.levels.front().grid / 2;
  if (std::has_single_bit(grid) && grid >= bake_options.coarsest_grid) bake_options.finest_grid = grid;
  bake_options.import = options.import;
  bake_options.job = options.job.step("importing the source", 0.0, 0.0);
  FARFIELD_TRY_LET(auto report, bake(options.source, folder, bake_options));
  return std::move(report.manifest);
}

/// Pictures of a wrong source would show its difference, not the levels': said before hours are spent on them.
Error other_source_error(const EvaluateOptions& options) {
  return {
      ErrorCode::InvalidArgument,
      fmt::format(
          "{}: was not baked from {} as it is now (or with another --mesh or --subdivide); bake it again, or compare "
          "all the same with --other-source",
          options.asset.string(), options.source.string())};
}

std::vector<std::string> captions(const LevelEvaluation& level) {
  const ErrorMetrics& e = level.errors;
  const ErrorMetrics& lit = level.lights.front().errors;
  return {fmt::format("level {}  grid {}^3  {} triangles  {} voxels", level.entry.level, level.entry.grid,
                      level.entry.triangles, level.entry.voxels),
          fmt::format("occlusion {:+.2f}%  rms {}  {}: color {}  bias {:+.2f}% {:+.2f}% {:+.2f}%",
                      100 * e.occlusion_error.value, size_text(e.occlusion_rms), name_of(level.lights.front().light),
                      size_text(lit.color_error), 100 * lit.color_bias[0].value, 100 * lit.color_bias[1].value,
                      100 * lit.color_bias[2].value)};
}

/// The view that is surely farthest off, by `error` of its metrics: noise does not make a view the worst.
template <typename Error>
size_t worst_of(const std::vector<ErrorMetrics>& views, const Error& error) {
  const auto surely = [&](const ErrorMetrics& metrics) {
    return std::abs(error(metrics).value) - kCertainty * error(metrics).standard_error;
  };
  const auto worst = std::max_element(
      views.begin(), views.end(), [&](const ErrorMetrics& a, const ErrorMetrics& b) { return surely(a) < surely(b); });
  return static_cast<size_t>(worst - views.begin());
}

/// The sums of one light, and what follows from them.
LightEvaluation summarize_light(Light light, const std::vector<ViewSums>& views) {
  LightEvaluation evaluation;
  evaluation.light = light;
  ViewSums total;
  for (const ViewSums& view : views) {
    total += view;
    evaluation.views.push_back(metrics_of(view));
  }
  evaluation.errors = metrics_of(total);
  evaluation.worst_view =
      worst_of(evaluation.views, [](const ErrorMetrics& metrics) { return metrics.largest_color_bias(); });
  return evaluation;
}

/// Coverage is the same under every light: all pictures count.
void summarize_coverage(const std::vector<std::vector<ViewSums>>& lights, LevelEvaluation& level) {
  ViewSums total;
  for (size_t view = 0; view < lights.front().size(); ++view) {
    ViewSums of_view;
    for (const std::vector<ViewSums>& views : lights) of_view += views[view];
    total += of_view;
    level.views.push_back(metrics_of(of_view));
  }
  level.errors = metrics_of(total);
  level.worst_view = worst_of(level.views, [](const ErrorMetrics& metrics) { return metrics.occlusion_error; });
}

/// `to` with the colour of `from`, and its own coverage.
ErrorMetrics with_color_of(const ErrorMetrics& to, ErrorMetrics from) {
  from.occlusion_error = to.occlusion_error;
  from.occlusion_rms = to.occlusion_rms;
  from.occlusion_rms_raw = to.occlusion_rms_raw;
  from.occlusion_rms_touched = to.occlusion_rms_touched;
  return from;
}

/// The state of one evaluation while it runs.
class Evaluator {
 public:
  Evaluator(const EvaluateOptions& options, const AssetView& source, const Box3& source_bounds)
      : options_(options), source_(source), source_bounds_(source_bounds) {}

  Result<Evaluation> run(const std::vector<LevelPlan>& plans) {
    for (const LevelPlan& plan : plans) total_cost_ += plan.cost() * static_cast<double>(options_.lights.size());
    if (!options_.images.empty()) FARFIELD_TRY(prepare_images(options_.images));
    Evaluation evaluation;
    evaluation.views = options_.views;
    for (const OrthoView& view : plans.front().views) evaluation.directions.push_back(view.direction);
    for (const LevelPlan& plan : plans) {
      FARFIELD_TRY_LET(auto level, evaluate_level(plan));
      evaluation.levels.push_back(std::move(level));
    }
    if (!options_.sheet.empty()) FARFIELD_TRY(write_png(options_.sheet, make_sheet(rows_)));
    return evaluation;
  }

 private:
  Result<LevelEvaluation> evaluate_level(const LevelPlan& plan) {
    const Clock::time_point start = Clock::now();
    FARFIELD_TRY_LET(auto asset, AssetView::open(options_.asset, static_cast<float>(plan.entry.level)));
    LevelEvaluation level;
    level.entry = plan.entry;
    level.samples_per_pixel = plan.samples_per_pixel;
    level.pixels = plan.pixels;
    std::vector<std::vector<ViewSums>> lights;
    for (const Light light : options_.lights) {
      FARFIELD_TRY_LET(auto views, sum_views(plan, light, *asset));
      level.lights.push_back(summarize_light(light, views));
      lights.push_back(std::move(views));
    }
    summarize_coverage(lights, level);
    for (const LightEvaluation& light : level.lights)
      if (light.light == Light::Daylight) level.errors = with_color_of(level.errors, light.errors);

    const uint64_t seed = mix64(mix64(options_.seed, plan.entry.level), kDepthSeed);
    FARFIELD_TRY_LET(level.depth,
                     measure_depths(source_, *asset, plan.views, source_bounds_, seed, options_.job.quiet()));
    level.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (!options_.sheet.empty()) rows_.back().captions = captions(level);
    return level;
  }

  Result<std::vector<ViewSums>> sum_views(const LevelPlan& plan, Light light, const AssetView& asset) {
    std::vector<ViewSums> views;
    for (size_t i = 0; i < plan.views.size(); ++i) {
      options_.job.report(done_cost_ / total_cost_, fmt::format("level {}, {}, view {}/{}", plan.entry.level,
                                                                name_of(light), i + 1, plan.views.size()));
      FARFIELD_TRY_LET(auto sums, compare_view(plan, i, light, asset));
      views.push_back(sums);
      done_cost_ += plan.cost() / static_cast<double>(plan.views.size());
    }
    return views;
  }

  Result<ViewSums> compare_view(const LevelPlan& plan, size_t index, Light light, const AssetView& asset) {
    const OrthoView& view = plan.views[index];
    const Lights lights = lights_for(light, view);
    const uint64_t level_seed = mix64(options_.seed, plan.entry.level);
    const uint64_t seed = mix64(mix64(level_seed, index), 2 * static_cast<uint64_t>(light));
    const Job job = options_.job.quiet();
    FARFIELD_TRY_LET(auto source, render_parts(source_, view, plan.samples_per_pixel, seed, lights, job));
    FARFIELD_TRY_LET(auto level, render_parts(asset, view, plan.samples_per_pixel, seed + 1, lights, job));
    FARFIELD_TRY(keep_pictures(plan, index, light, source, level));
    return sum_view(source, level);
  }

  /// For the sheet and the folder of images, where they are asked for.
  Result<void> keep_pictures(const LevelPlan& plan, size_t index, Light light, const std::vector<Image>& source,
                             const std::vector<Image>& level) {
    const bool in_sheet = !options_.sheet.empty() && index == 0 && light == options_.lights.front();
    if (!in_sheet && options_.images.empty()) return {};
    Image source_image = mean_image(source), level_image = mean_image(level);
    if (!options_.images.empty())
      FARFIELD_TRY(write_images(options_.images, plan, index, light, source_image, level_image));
    if (in_sheet) rows_.push_back({std::move(source_image), std::move(level_image), {}});
    return {};
  }

  static constexpr uint64_t kDepthSeed = 0x6465707468;  // "depth"; no view has this number

  const EvaluateOptions& options_;
  const AssetView& source_;
  const Box3 source_bounds_;
  std::vector<SheetRow> rows_;
  double total_cost_ = 0, done_cost_ = 0;
};

bool is_other_source(const Manifest& manifest, const Manifest& source) {
  return source.source_hash != manifest.source_hash;
}

Result<Evaluation> compare(const EvaluateOptions& options, const Manifest& manifest, const Manifest& source_manifest,
                           const fs::path& source_folder) {
  if (is_other_source(manifest, source_manifest) && !options.other_source)
    return tl::unexpected(other_source_error(options));
  const Box3 source_bounds = in_source_space(source_manifest.bounds, source_manifest);
  FARFIELD_TRY_LET(const auto plans, plan_evaluation(manifest, source_bounds, options));
  FARFIELD_TRY_LET(const auto source, AssetView::open(source_folder, 0.0f));
  return Evaluator(options, *source, source_bounds).run(plans);
}

/// Puts the errors into the asset's manifest, where `farfield info` finds them.
Result<void> record_errors(const fs::path& asset, const std::vector<LevelEvaluation>& levels) {
  FARFIELD_TRY_LET(auto manifest, read_manifest(asset));
  for (const LevelEvaluation& level : levels)
    for (LevelEntry& entry : manifest.levels)
      if (entry.level == level.entry.level)
        entry.errors = LevelErrors{level.errors.occlusion_error.value, level.errors.occlusion_rms.size(),
                                   level.errors.color_error.size()};
  return write_manifest(asset, manifest);
}

/// Why the errors cannot be recorded; empty if they can.
std::string why_not_recorded(const EvaluateOptions& options, bool is_other) {
  if (is_other)
    return fmt::format("{}: was baked from a file that differs from {}; the errors are not recorded in the asset",
                       options.asset.string(), options.source.string());
  if (std::find(options.lights.begin(), options.lights.end(), Light::Daylight) == options.lights.end())
    return fmt::format(
        "{}: the errors are not recorded in the asset, which keeps those in daylight; it is not among "
        "--lights",
        options.asset.string());
  return {};
}

Result<void> check_options(const EvaluateOptions& options) {
  if (options.views < 1 || options.samples_per_pixel < 0 || options.lights.empty())
    return make_error(ErrorCode::InvalidArgument,
                      "evaluate needs at least one view, one light and one sample per pixel");
  return {};
}

}  // namespace

bool LevelEvaluation::has_daylight() const {
  return std::any_of(lights.begin(), lights.end(),
                     [](const LightEvaluation& evaluation) { return evaluation.light == Light::Daylight; });
}

Result<Evaluation> evaluate(const EvaluateOptions& options) {
  FARFIELD_TRY(check_options(options));
  FARFIELD_TRY_LET(const auto manifest, read_manifest(options.asset));
  FARFIELD_TRY_LET(auto folder, TemporaryFolder::create());
  const bool has_source = !options.source.empty();
  const fs::path& source_folder = has_source ? folder.path() : options.asset;
  FARFIELD_TRY_LET(const auto source_manifest, has_source ? bake_source(options, manifest, source_folder) : manifest);

  // What the import warned of is as true of the pictures.
  auto compared = compare(options, manifest, source_manifest, source_folder);
  FARFIELD_TRY_LET(auto evaluation, with_warnings(std::move(compared), source_manifest.warnings));
  evaluation.warnings = source_manifest.warnings;
  if (const std::string reason = why_not_recorded(options, is_other_source(manifest, source_manifest));
      !reason.empty()) {
    evaluation.warnings.push_back(reason);
    return evaluation;
  }
  if (auto recorded = record_errors(options.asset, evaluation.levels); !recorded)
    evaluation.warnings.push_back(fmt::format("errors are not recorded in the asset: {}", recorded.error().message));
  return evaluation;
}

}  // namespace farfield
