// SPDX-License-Identifier: Apache-2.0
#include "runtime/frame_planner.h"

#include <algorithm>
#include <limits>

#include "base/parallel.h"
#include "base/result.h"
#include "lodselect/footprint.h"

namespace farfield {

namespace {

// A camera footprint's share of an image: no instance counts for more pixels than a frame has.
constexpr double kLargestPixelCount = 1e7;
// From here on it is worth another look at how many they are.
constexpr double kManyPixels = 1e4;

}  // namespace

void FramePlanner::note_moved(uint32_t instance) {
  constexpr size_t kFewest = 1024, kLargestShare = 16;
  if (instance >= up_to_date_) return;
  moved_.push_back(instance);
  if (moved_.size() < std::max(kFewest, up_to_date_ / kLargestShare)) return;
  moved_ = {};  // as well all of them: the list takes memory
  up_to_date_ = 0;
}

void FramePlanner::update_footprint(uint32_t i, const std::vector<TessellationCamera>& of_cameras) {
  InstanceRecord& instance = geometry_.instances[i];
  const bool is_seen = !of_cameras.empty() && !geometry_.is_hidden(i);
  instance.footprint.camera_footprint = is_seen ? finest_footprint(of_cameras, geometry_.bounds_over_time(i)) : 0.0f;
}

void FramePlanner::update_footprints(const std::vector<TessellationCamera>& of_cameras) {
  constexpr size_t kGrain = 1024;
  const size_t first = of_cameras == footprint_cameras_ ? up_to_date_ : 0;
  const size_t count = geometry_.instances.size() - first;
  parallel_for(count, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) update_footprint(static_cast<uint32_t>(first + i), of_cameras);
  });
  for (const uint32_t i : moved_) update_footprint(i, of_cameras);
  footprint_cameras_ = of_cameras;
  up_to_date_ = geometry_.instances.size();
  moved_.clear();
}

/// The lambda that the cameras ask for on an instance, at least 0, not clamped to what there is.
float FramePlanner::wanted_lambda(const InstanceRecord& instance) const {
  if (options_.forced_lambda) return std::max(0.0f, *options_.forced_lambda);
  const InstanceFootprint& footprint = instance.footprint;
  const float lambda =
      lambda_of_footprint(footprint.camera_footprint * footprint.world_to_r0,
                          geometry_.assets[instance.asset]->base_resolution, std::numeric_limits<int>::max());
  return std::clamp<float>(lambda, instance.limits.finest, instance.limits.coarsest);
}

std::vector<PlanAsset> FramePlanner::wanted_assets(const LevelStore& levels) const {
  std::vector<PlanAsset> wanted;
  for (uint32_t i = 0; i < levels.asset_count(); ++i) {
    wanted.push_back(levels.plan_asset(i));
    if (options_.forced_lambda) wanted.back().ray_cost.clear();  // that very level, whatever it costs
  }
  for (uint32_t i = 0; i < geometry_.instances.size(); ++i) {
    if (geometry_.is_hidden(i)) continue;
    const InstanceRecord& instance = geometry_.instances[i];
    PlanAsset& asset = wanted[instance.asset];
    // The longest side of the world, in pixels, squared.
    const double diagonal = glm::length(geometry_.assets[instance.asset]->bounds.size());
    const double pixel = instance.footprint.camera_footprint * instance.footprint.world_to_r0;
    const double across = pixel > 0.0 ? options_.pixel_error * diagonal / pixel : kLargestPixelCount;
    double pixels = std::min(across * across, kLargestPixelCount);
    // Its nearest point says too much of a ground, of which most is far and seen at a slant.
    if (pixels > kManyPixels && !cameras_.empty()) {
      pixels = std::min(pixels, covered_pixels(cameras_, geometry_.bounds_over_time(i)));
    }
    asset.ask(wanted_lambda(instance), pixels);
  }
  return wanted;
}

/// Textures come after roots and before finer levels: a close-up with its textures is worth more than a finer level
/// elsewhere. Where not even the roots leave them room, faces show what they are on average.
Result<FramePlanner::TexturedPlan> FramePlanner::plan_with_textures(LevelStore& levels) const {
  const std::vector<PlanAsset> wanted = wanted_assets(levels);
  FARFIELD_TRY_LET(const auto bare, plan_levels(wanted, options_.budget_bytes, levels.fixed_bytes()));
  const uint64_t texture_bytes = levels.wanted_texture_bytes(bare);
  if (texture_bytes == 0) return TexturedPlan{bare, 0};
  const auto plan = plan_levels(wanted, options_.budget_bytes, levels.fixed_bytes() + texture_bytes);
  if (plan) return TexturedPlan{*plan, levels.wanted_texture_bytes(*plan)};
  levels.report_no_room_for_textures(plan.error());
  return TexturedPlan{bare, 0};
}

Result<PlanSummary> FramePlanner::plan(LevelStore& levels) {
  if (cameras_.empty() && !options_.forced_lambda) {
    return make_error(ErrorCode::InvalidArgument, "plan_frame() needs a camera: call set_cameras() before");
  }
  levels.stop_loading();
  update_footprints(cameras_);
  const auto plan = plan_with_textures(levels);
  if (!plan) {
    update_footprints(planned_cameras_);  // the former plan stays
    return tl::unexpected(plan.error());
  }
  planned_cameras_ = cameras_;
  levels.apply(*plan, plan->texture_bytes);

  PlanSummary summary;
  for (uint32_t i = 0; i < levels.asset_count(); ++i) {
    summary.finest_level.push_back(levels.asset(i).levels[plan->finest(i)].level);
  }
  summary.planned_bytes = plan->resident_bytes + plan->build_peak_bytes + levels.fixed_bytes() + plan->texture_bytes;
  summary.bias = plan->bias;
  summary.levels_given_up = plan->levels_given_up;
  summary.asked_bytes = plan->asked_bytes;
  for (const std::vector<uint8_t>& slots : plan->morphs) summary.morphs += static_cast<uint32_t>(slots.size());
  summary.morphs_given_up = plan->morphs_given_up;
  return summary;
}

void FramePlanner::prefetch(LevelStore& levels) const {
  std::vector<std::vector<bool>> is_needed(levels.asset_count());
  for (uint32_t i = 0; i < levels.asset_count(); ++i) is_needed[i].resize(levels.asset(i).traced.slot_count());
  auto is_morph_needed = is_needed;
  for (uint32_t i = 0; i < geometry_.instances.size(); ++i) {
    if (geometry_.is_hidden(i)) continue;
    const InstanceRecord& instance = geometry_.instances[i];
    const SlotBlend slots = split_slots(*geometry_.assets[instance.asset], wanted_lambda(instance));
    is_needed[instance.asset][slots.slot] = true;
    if (!(slots.blend > 0.0f)) continue;
    is_needed[instance.asset][slots.coarser] = true;
    is_morph_needed[instance.asset][slots.slot] = geometry_.assets[instance.asset]->may_morph(slots.slot);
  }
  for (uint32_t i = 0; i < levels.asset_count(); ++i) {
    for (size_t slot = is_needed[i].size(); slot-- > 0;) {  // coarse ones first: they are what others fall back to
      if (is_needed[i][slot]) levels.load(i, static_cast<uint32_t>(slot));
    }
    for (size_t slot = 0; slot < is_morph_needed[i].size(); ++slot) {
      if (is_morph_needed[i][slot]) levels.load_morph(i, static_cast<uint32_t>(slot));
    }
  }
}

}  // namespace farfield
