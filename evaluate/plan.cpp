// SPDX-License-Identifier: Apache-2.0
#include "evaluate/plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/result.h"
#include "cache/level_file.h"
#include "evaluate/evaluate.h"
#include "evaluate/view_sums.h"

namespace farfield {
namespace {

/// What the level's pictures have to show: the level and its source. (The bounds of the whole asset are those of its
/// root, which may be voxels wider.)
Result<Box3> bounds_of(const EvaluateOptions& options, const Manifest& manifest, const LevelEntry& entry) {
  FARFIELD_TRY_LET(const auto file, LevelFile::open(options.asset / entry.file, LevelCheck::Structure));
  return in_source_space(file->view().header.bounds, manifest);
}

int in_whole_parts(int samples_per_pixel) {
  constexpr int kStep = static_cast<int>(kParts);
  return (samples_per_pixel + kStep - 1) / kStep * kStep;
}

Result<LevelPlan> plan_level(const LevelEntry& entry, const Box3& bounds, const EvaluateOptions& options) {
  constexpr uint64_t kMaxPicture = uint64_t{1} << 26;
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
  plan.samples_per_pixel = options.samples_per_pixel > 0 ? in_whole_parts(options.samples_per_pixel)
                                                         : default_samples_per_pixel(plan.pixels);
  return plan;
}

}  // namespace

Result<std::vector<LevelPlan>> plan_evaluation(const Manifest& manifest, const Box3& source_bounds,
                                               const EvaluateOptions& options) {
  std::vector<LevelPlan> plans;
  for (const LevelEntry& entry : manifest.levels) {
    if (entry.level < options.first_level || entry.level > options.last_level) continue;
    FARFIELD_TRY_LET(auto bounds, bounds_of(options, manifest, entry));
    bounds.extend(source_bounds);
    FARFIELD_TRY_LET(auto plan, plan_level(entry, bounds, options));
    plans.push_back(std::move(plan));
  }
  if (plans.empty())
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: has no level between {} and {}; `farfield info` lists them",
                                  options.asset.string(), options.first_level, options.last_level));
  return plans;
}

int default_samples_per_pixel(uint64_t pixels) {
  constexpr uint64_t kSamples = 1'500'000;  // per picture set, light and level: docs/error_metric.md has the times
  const uint64_t samples = kSamples / std::max<uint64_t>(pixels, 1);
  return static_cast<int>(std::clamp<uint64_t>(samples / kParts * kParts, 8, 4096));
}

}  // namespace farfield
