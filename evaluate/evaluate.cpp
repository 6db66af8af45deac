// SPDX-License-Identifier: Apache-2.0
#include "evaluate/evaluate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bake/bake.h"
#include "base/hash.h"
#include "base/result.h"
#include "base/temporary_file.h"
#include "cache/level_file.h"
#include "evaluate/sheet.h"
#include "evaluate/views.h"
#include "path_tracer/asset_view.h"
#include "path_tracer/environment.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kParts = 4;  // two renders of two half-buffers each: what metrics.h needs to tell noise from error

/// What will be rendered for one level.
struct LevelPlan {
  LevelEntry entry;
  std::vector<OrthoView> views;
  uint64_t pixels = 0;  ///< over all views
  int samples_per_pixel = 0;

  double cost() const { return static_cast<double>(pixels) * samples_per_pixel; }
};

/// One picture of one view, in independent parts.
using Parts = std::vector<Image>;

Box3 in_source_space(const Box3& bounds, const Manifest& manifest) {
  return {bounds.lower + vec3(manifest.origin), bounds.upper + vec3(manifest.origin)};
}

/// What the level's pictures have to show: the level and its source. (The bounds of the whole asset are those of its
/// root, which may be voxels wider.)
Result<Box3> bounds_of(const EvaluateOptions& options, const Manifest& manifest, const LevelEntry& entry) {
  FARFIELD_TRY_LET(const auto file, LevelFile::open(options.asset / entry.file, LevelCheck::Structure));
  return in_source_space(file->view().header.bounds, manifest);
}

Result<std::vector<LevelPlan>> plan_evaluation(const Manifest& manifest, const Box3& source_bounds,
                                               const EvaluateOptions& options) {
  constexpr uint64_t kMaxPicture = uint64_t{1} << 26;
  std::vector<LevelPlan> plans;
  for (const LevelEntry& entry : manifest.levels) {
    if (entry.level < options.first_level || entry.level > options.last_level) continue;
    FARFIELD_TRY_LET(auto bounds, bounds_of(options, manifest, entry));
    bounds.extend(source_bounds);
    LevelPlan plan{entry, {}, 0, 0};
    for (const vec3& direction : view_directions(options.views)) {
      const OrthoView view = frame_view(bounds, direction, static_cast<float>(entry.resolution));
      const uint64_t pixels = static_cast<uint64_t>(view.width_px) * static_cast<uint64_t>(view.height_px);
      if (pixels > kMaxPicture)
        return make_error(ErrorCode::InvalidArgument,
                          fmt::format("{}: level {} needs pictures of {} x {} pixels; evaluate coarser levels only",
                                      options.asset.string(), entry.level, view.width_px, view.height_px));
      plan.views.push_back(view);
      plan.pixels += pixels;
    }
    plan.samples_per_pixel = options.samples_per_pixel > 0 ? (options.samples_per_pixel + kParts - 1) / kParts * kParts
                                                           : default_samples_per_pixel(plan.pixels);
    plans.push_back(std::move(plan));
  }
  if (plans.empty())
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: has no level between {} and {}; `farfield info` lists them",
                                  options.asset.string(), options.first_level, options.last_level));
  return plans;
}

/// Imports the source anew into an asset of level 0 only, which the path tracer then renders like any other.
Result<Manifest> bake_source(const EvaluateOptions& options, const fs::path& folder) {
  BakeOptions bake_options;
  bake_options.source_only = true;
  bake_options.import = options.import;
  bake_options.job = options.job.step("importing the source", 0.0, 0.0);
  FARFIELD_TRY_LET(auto report, bake(options.source, folder, bake_options));
  return std::move(report.manifest);
}

/// Pictures of a wrong source would show its difference, not the levels': said before hours are spent on them.
Error other_source_error(const EvaluateOptions& options) {
  return {
      ErrorCode::InvalidArgument,
      fmt::format("{}: was not baked from {} as it is now (or from another --mesh of it); bake it again, or compare "
                  "all the same with --other-source",
                  options.asset.string(), options.source.string())};
}

Result<Parts> render_parts(const AssetView& asset, const OrthoView& view, int samples_per_pixel, uint64_t seed,
                           const Lights& lights, const Job& job) {
  ViewOptions options;
  options.center = view.center;
  options.direction = view.direction;
  options.up = view.up;
  options.width_world = view.width();
  options.width = view.width_px;
  options.height = view.height_px;
  options.trace.samples_per_pixel = samples_per_pixel / 2;
  Parts parts;
  for (uint64_t render = 0; render < kParts / 2; ++render) {
    options.trace.seed = mix64(seed, render);
    FARFIELD_TRY_LET(auto images, asset.render(options, lights, job));
    for (Image& half : images.half) parts.push_back(std::move(half));
  }
  return parts;
}

/// The light, as another renderer needs it.
Metadata light_metadata(const SunSkyOptions& light, const Environment& environment) {
  const vec3 sun_direction = glm::normalize(light.sun_direction);
  return {{"farfield:sun_direction", sun_direction},
          {"farfield:sun_radiance", environment.radiance(sun_direction)},
          {"farfield:sun_irradiance", light.sun_irradiance},
          {"farfield:sun_angle_rad", light.sun_angle_rad},
          {"farfield:sky_model", std::string("Preetham 1999, +y up, see environment.exr")},
          {"farfield:sky_turbidity", light.turbidity},
          {"farfield:ground_albedo", light.ground_albedo}};
}

Metadata view_metadata(Metadata metadata, const LevelPlan& plan, const OrthoView& view) {
  metadata["farfield:level"] = static_cast<int>(plan.entry.level);
  metadata["farfield:resolution"] = static_cast<float>(plan.entry.resolution);
  metadata["farfield:samples_per_pixel"] = plan.samples_per_pixel;
  metadata["farfield:camera_direction"] = view.direction;
  metadata["farfield:camera_up"] = view.up;
  metadata["farfield:camera_center"] = view.center;
  metadata["farfield:orthographic_width"] = view.width();
  return metadata;
}

Result<void> make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return make_error(ErrorCode::Io, fmt::format("{}: cannot make this folder: {}", folder.string(), error.message()));
  return {};
}

std::vector<std::string> captions(const LevelEvaluation& level) {
  const ErrorMetrics& e = level.errors;
  return {fmt::format("level {}  grid {}^3  {} triangles  {} voxels", level.entry.level, level.entry.grid,
                      level.entry.triangles, level.entry.voxels),
          fmt::format("occlusion {:+.2f}%  rms {:.2f}%  color {:.2f}%  bias {:+.2f}% {:+.2f}% {:+.2f}%",
                      100 * e.occlusion_error.value, 100 * e.occlusion_rms.value, 100 * e.color_error.value,
                      100 * e.color_bias[0].value, 100 * e.color_bias[1].value, 100 * e.color_bias[2].value)};
}

/// The state of one evaluation while it runs.
class Evaluator {
 public:
  Evaluator(const EvaluateOptions& options, const AssetView& source)
      : options_(options), source_(source), light_(default_sun_sky()) {
    lights_.environment = Environment::sun_sky(light_);
    light_metadata_ = light_metadata(light_, lights_.environment);
  }

  Result<Evaluation> run(const std::vector<LevelPlan>& plans) {
    for (const LevelPlan& plan : plans) total_cost_ += plan.cost();
    FARFIELD_TRY(prepare_images());
    Evaluation evaluation;
    evaluation.views = options_.views;
    for (const LevelPlan& plan : plans) {
      FARFIELD_TRY_LET(auto level, evaluate_level(plan));
      evaluation.levels.push_back(std::move(level));
    }
    if (!options_.sheet.empty()) FARFIELD_TRY(write_png(options_.sheet, make_sheet(rows_)));
    return evaluation;
  }

 private:
  Result<void> prepare_images() const {
    if (options_.images.empty()) return {};
    FARFIELD_TRY(make_folder(options_.images));
    return write_exr(options_.images / "environment.exr", lights_.environment.to_image(1024), light_metadata_);
  }

  Result<LevelEvaluation> evaluate_level(const LevelPlan& plan) {
    const Clock::time_point start = Clock::now();
    FARFIELD_TRY_LET(auto asset, AssetView::open(options_.asset, static_cast<float>(plan.entry.level)));
    ErrorAccumulator accumulator;
    for (size_t i = 0; i < plan.views.size(); ++i) {
      options_.job.report(done_cost_ / total_cost_,
                          fmt::format("level {}, view {}/{}", plan.entry.level, i + 1, plan.views.size()));
      FARFIELD_TRY(evaluate_view(plan, i, *asset, accumulator));
      done_cost_ += plan.cost() / static_cast<double>(plan.views.size());
    }
    LevelEvaluation level{plan.entry, accumulator.metrics(), plan.samples_per_pixel, plan.pixels, 0};
    level.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (!options_.sheet.empty()) rows_.back().captions = captions(level);
    return level;
  }

  Result<void> evaluate_view(const LevelPlan& plan, size_t index, const AssetView& asset,
                             ErrorAccumulator& accumulator) {
    const OrthoView& view = plan.views[index];
    const uint64_t seed = mix64(mix64(options_.seed, plan.entry.level), 2 * index);
    FARFIELD_TRY_LET(auto source,
                     render_parts(source_, view, plan.samples_per_pixel, seed, lights_, options_.job.quiet()));
    FARFIELD_TRY_LET(auto level,
                     render_parts(asset, view, plan.samples_per_pixel, seed + 1, lights_, options_.job.quiet()));
    FARFIELD_TRY(accumulator.add_view(source, level));

    const bool in_sheet = !options_.sheet.empty() && index == 0;
    if (!in_sheet && options_.images.empty()) return {};
    Image source_image = mean_image(source), level_image = mean_image(level);
    FARFIELD_TRY(write_images(plan, index, source_image, level_image));
    if (in_sheet) rows_.push_back({std::move(source_image), std::move(level_image), {}});
    return {};
  }

  Result<void> write_images(const LevelPlan& plan, size_t index, const Image& source, const Image& level) const {
    if (options_.images.empty()) return {};
    const Metadata metadata = view_metadata(light_metadata_, plan, plan.views[index]);
    const std::string name = fmt::format("level_{:02}_view_{:02}_", plan.entry.level, index);
    FARFIELD_TRY(write_exr(options_.images / (name + "source.exr"), source, metadata));
    return write_exr(options_.images / (name + "level.exr"), level, metadata);
  }

  const EvaluateOptions& options_;
  const AssetView& source_;
  SunSkyOptions light_;
  Lights lights_;
  Metadata light_metadata_;
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
  return Evaluator(options, *source).run(plans);
}

/// Puts the errors into the asset's manifest, where `farfield info` finds them.
Result<void> record_errors(const fs::path& asset, const std::vector<LevelEvaluation>& levels) {
  FARFIELD_TRY_LET(auto manifest, read_manifest(asset));
  for (const LevelEvaluation& level : levels)
    for (LevelEntry& entry : manifest.levels)
      if (entry.level == level.entry.level)
        entry.errors = LevelErrors{level.errors.occlusion_error.value, level.errors.occlusion_rms.value,
                                   level.errors.color_error.value};
  return write_manifest(asset, manifest);
}

}  // namespace

int default_samples_per_pixel(uint64_t pixels) {
  constexpr uint64_t kSamples = 16'000'000;  // per picture and level: docs/error_metric.md has the times
  const uint64_t samples = kSamples / std::max<uint64_t>(pixels, 1);
  return static_cast<int>(std::clamp<uint64_t>(samples / kParts * kParts, 8, 4096));
}

Result<Evaluation> evaluate(const EvaluateOptions& options) {
  if (options.views < 1 || options.samples_per_pixel < 0)
    return make_error(ErrorCode::InvalidArgument, "evaluate needs at least one view and one sample per pixel");
  FARFIELD_TRY_LET(const auto manifest, read_manifest(options.asset));
  FARFIELD_TRY_LET(auto folder, TemporaryFolder::create());
  const bool has_source = !options.source.empty();
  const fs::path& source_folder = has_source ? folder.path() : options.asset;
  FARFIELD_TRY_LET(const auto source_manifest, has_source ? bake_source(options, source_folder) : manifest);

  // What the import warned of is as true of the pictures.
  auto compared = compare(options, manifest, source_manifest, source_folder);
  FARFIELD_TRY_LET(auto evaluation, with_warnings(std::move(compared), source_manifest.warnings));
  evaluation.warnings = source_manifest.warnings;
  if (is_other_source(manifest, source_manifest)) {
    evaluation.warnings.push_back(
        fmt::format("{}: was baked from a file that differs from {}; the errors are not recorded in the asset",
                    options.asset.string(), options.source.string()));
    return evaluation;
  }
  if (auto recorded = record_errors(options.asset, evaluation.levels); !recorded)
    evaluation.warnings.push_back(fmt::format("errors are not recorded in the asset: {}", recorded.error().message));
  return evaluation;
}

std::string to_json(const Evaluation& evaluation) {
  using Json = nlohmann::ordered_json;
  Json levels = Json::array();
  for (const LevelEvaluation& level : evaluation.levels) {
    const ErrorMetrics& e = level.errors;
    levels.push_back({
        {"level", level.entry.level},
        {"grid", level.entry.grid},
        {"resolution", level.entry.resolution},
        {"occlusion_error", e.occlusion_error.value},
        {"occlusion_rms", e.occlusion_rms.value},
        {"color_error", e.color_error.value},
        {"color_bias", {e.color_bias[0].value, e.color_bias[1].value, e.color_bias[2].value}},
        {"color_rest", e.color_rest.value},
        {"triangles", level.entry.triangles},
        {"voxels", level.entry.voxels},
        {"bytes_disk", level.entry.file_bytes},
        {"bytes_resident", level.entry.resident_bytes},
        {"color_error_raw", e.color_error_raw},
        {"color_error_low", e.color_error_low},
        {"color_noise", e.color_noise},
        {"occlusion_rms_raw", e.occlusion_rms_raw},
        {"standard_errors",
         {{"occlusion_error", e.occlusion_error.standard_error},
          {"occlusion_rms", e.occlusion_rms.standard_error},
          {"color_error", e.color_error.standard_error},
          {"color_bias",
           {e.color_bias[0].standard_error, e.color_bias[1].standard_error, e.color_bias[2].standard_error}},
          {"color_rest", e.color_rest.standard_error}}},
        {"samples_per_pixel", level.samples_per_pixel},
        {"pixels", level.pixels},
        {"seconds", level.seconds},
    });
  }
  const Json json = {{"views", evaluation.views}, {"warnings", evaluation.warnings}, {"levels", levels}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace farfield
