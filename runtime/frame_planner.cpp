// SPDX-License-Identifier: Apache-2.0
#include "runtime/frame_planner.h"

#include <algorithm>
#include <limits>
#include <set>

#include "base/parallel.h"
#include "base/result.h"
#include "lodselect/footprint.h"

namespace farfield {

namespace {

// A camera footprint's share of an image: no instance counts for more pixels than a frame has.
constexpr double kLargestPixelCount = 1e7;
// From here on it is worth another look at how many they are.
constexpr double kManyPixels = 1e4;
// Instances whose footprints are known at a time.
constexpr size_t kBlock = 1 << 15;

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
float FramePlanner::wanted_lambda(const InstanceRecord& instance, float camera_footprint) const {
  if (options_.forced_lambda) return std::max(0.0f, *options_.forced_lambda);
  const float lambda =
      lambda_of_footprint(camera_footprint * instance.footprint.world_to_r0,
                          geometry_.assets[instance.asset]->base_resolution, std::numeric_limits<int>::max());
  return std::clamp<float>(lambda, instance.limits.finest, instance.limits.coarsest);
}

/// How many pixels of the cameras an instance counts for, with its footprint in them.
double FramePlanner::pixels_of(uint32_t i, float footprint, std::span<const TessellationCamera> cameras) const {
  const InstanceRecord& instance = geometry_.instances[i];
  // The longest side of the world, in pixels, squared.
  const double diagonal = glm::length(geometry_.assets[instance.asset]->bounds.size());
  const double pixel = footprint * instance.footprint.world_to_r0;
  const double across = pixel > 0.0 ? options_.pixel_error * diagonal / pixel : kLargestPixelCount;
  const double pixels = std::min(across * across, kLargestPixelCount);
  if (pixels <= kManyPixels || cameras.empty()) return pixels;
  // Its nearest point says too much of a ground, of which most is far and seen at a slant.
  return std::min(pixels, covered_pixels(cameras, geometry_.bounds_over_time(i)));
}

std::vector<PlanAsset> FramePlanner::wanted_assets(const LevelStore& levels, const Footprints& footprints,
                                                   std::span<const TessellationCamera> cameras) const {
  std::vector<PlanAsset> wanted;
  for (uint32_t i = 0; i < levels.asset_count(); ++i) {
    wanted.push_back(levels.plan_asset(i));
    if (options_.forced_lambda) wanted.back().ray_cost.clear();  // that very level, whatever it costs
  }
  const std::vector<InstanceRecord>& instances = geometry_.instances;
  std::vector<float> block(std::min(instances.size(), kBlock));
  for (size_t i = 0; i < instances.size(); ++i) {
    if (i % kBlock == 0) footprints(i, std::span(block).first(std::min(kBlock, instances.size() - i)));
    if (geometry_.is_hidden(static_cast<uint32_t>(i))) continue;
    const InstanceRecord& instance = instances[i];
    const float footprint = block[i % kBlock];
    PlanAsset& asset = wanted[instance.asset];
    asset.ask(wanted_lambda(instance, footprint), pixels_of(static_cast<uint32_t>(i), footprint, cameras));
  }
  return wanted;
}

/// Textures come after roots and before finer levels: a close-up with its textures is worth more than a finer level
/// elsewhere. Where not even the roots leave them room, faces show what they are on average.
Result<FramePlanner::TexturedPlan> FramePlanner::plan_with_textures(const LevelStore& levels,
                                                                    std::span<const PlanAsset> wanted,
                                                                    uint64_t budget_bytes) {
  FARFIELD_TRY_LET(const auto bare, plan_levels(wanted, budget_bytes, levels.fixed_bytes()));
  const uint64_t texture_bytes = levels.wanted_texture_bytes(bare);
  if (texture_bytes == 0) return TexturedPlan{bare, 0, {}};
  const auto plan = plan_levels(wanted, budget_bytes, levels.fixed_bytes() + texture_bytes);
  if (plan) return TexturedPlan{*plan, levels.wanted_texture_bytes(*plan), {}};
  return TexturedPlan{bare, 0, plan.error()};
}

/// All lambdas that are asked of a stored level lie between the same usable ones, and the coarsest of them decides
/// whether any blends with the coarser one.
FramePlanner::Needed FramePlanner::needed(std::span<const PlanAsset> wanted, const Plan& plan) const {
  Needed needed;
  for (uint32_t i = 0; i < wanted.size(); ++i) {
    std::set<uint32_t> levels, morphs;
    for (const LevelDemand& demand : wanted[i].demand) {
      if (!(demand.pixels > 0)) continue;
      const SlotBlend slots = split_slots(*geometry_.assets[i], plan.usable[i], demand.coarsest_lambda);
      levels.insert(slots.slot);
      if (!(slots.blend > 0.0f)) continue;
      levels.insert(slots.coarser);
      if (std::ranges::count(plan.morphs[i], slots.slot) > 0) morphs.insert(slots.slot);
    }
    // Coarse ones first: they are what others fall back to.
    for (auto slot = levels.rbegin(); slot != levels.rend(); ++slot) needed.levels.push_back({i, *slot});
    for (const uint32_t slot : morphs) needed.morphs.push_back({i, slot});
  }
  return needed;
}

Result<PlanSummary> FramePlanner::plan(LevelStore& levels) {
  if (cameras_.empty() && !options_.forced_lambda) {
    return make_error(ErrorCode::InvalidArgument, "plan_frame() needs a camera: call set_cameras() before");
  }
  levels.stop_loading();
  update_footprints(cameras_);
  const auto recorded = [&](size_t first, std::span<float> footprints) {
    for (size_t i = 0; i < footprints.size(); ++i)
      footprints[i] = geometry_.instances[first + i].footprint.camera_footprint;
  };
  const std::vector<PlanAsset> wanted = wanted_assets(levels, recorded, cameras_);
  const auto plan = plan_with_textures(levels, wanted, options_.budget_bytes);
  if (!plan) {
    update_footprints(planned_cameras_);  // the former plan stays
    return tl::unexpected(plan.error());
  }
  planned_cameras_ = cameras_;
  if (plan->no_room_for_textures) levels.report_no_room_for_textures(*plan->no_room_for_textures);
  needed_ = needed(wanted, *plan);
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
  levels.load(needed_.levels);
  levels.load_morphs(needed_.morphs);
}

void FramePlanner::look_ahead(LevelStore& levels, const std::vector<TessellationCamera>& next) const {
  if (!levels.has_ahead_room() || next.empty()) return levels.load_ahead({});
  const auto of_next = [&](size_t first, std::span<float> footprints) {
    constexpr size_t kGrain = 1024;
    parallel_for(footprints.size(), kGrain, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const auto instance = static_cast<uint32_t>(first + i);
        footprints[i] =
            geometry_.is_hidden(instance) ? 0.0f : finest_footprint(next, geometry_.bounds_over_time(instance));
      }
    });
  };
  const std::vector<PlanAsset> wanted = wanted_assets(levels, of_next, next);
  if (const auto plan = plan_with_textures(levels, wanted, options_.budget_bytes))
    levels.load_ahead(needed(wanted, *plan).levels);
}

}  // namespace farfield
