// SPDX-License-Identifier: Apache-2.0
// What the tessellation cameras ask of each asset, and the plan that fits the budget.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "bvh/instance_geometry.h"
#include "farfield/runtime.h"
#include "runtime/level_store.h"

namespace farfield {

/// Refers to the instances, whose camera footprints it sets. One thread, between frames.
class FramePlanner {
 public:
  FramePlanner(const RuntimeOptions& options, InstanceGeometry& geometry) : options_(options), geometry_(geometry) {}

  /// Of the coming plan.
  void set_cameras(std::vector<TessellationCamera> cameras) { cameras_ = std::move(cameras); }

  /// An instance that there was at the last plan stands elsewhere now. New ones need not be named.
  void note_moved(uint32_t instance);

  /// Plans for the cameras and puts the plan in force. After an error the former plan and its footprints stay.
  /// Errors: OutOfBudget, InvalidArgument (no camera).
  Result<PlanSummary> plan(LevelStore& levels);

  /// Loads what the cameras will certainly need under the current plan.
  void prefetch(LevelStore& levels) const;

  /// Starts to load what these cameras, of the next frame, would certainly need under its plan. Also while rays fly.
  void look_ahead(LevelStore& levels, const std::vector<TessellationCamera>& next) const;

 private:
  struct TexturedPlan : Plan {
    uint64_t texture_bytes = 0;
    std::optional<Error> no_room_for_textures;
  };
  /// What cameras certainly see under a plan: levels, coarse ones first for each asset, and levels that morph.
  struct Needed {
    std::vector<LevelSlot> levels, morphs;
  };
  /// Camera footprints of instances `first` .. `first` + size - 1.
  using Footprints = std::function<void(size_t first, std::span<float> footprints)>;

  static Result<TexturedPlan> plan_with_textures(const LevelStore& levels, std::span<const PlanAsset> wanted,
                                                 uint64_t budget_bytes);
  Needed needed(std::span<const PlanAsset> wanted, const Plan& plan) const;
  void update_footprints(const std::vector<TessellationCamera>& of_cameras);
  void update_footprint(uint32_t instance, const std::vector<TessellationCamera>& of_cameras);
  float wanted_lambda(const InstanceRecord& instance, float camera_footprint) const;
  double pixels_of(uint32_t instance, float footprint, std::span<const TessellationCamera> cameras) const;
  /// Footprints and pixels are those of `cameras`.
  std::vector<PlanAsset> wanted_assets(const LevelStore& levels, const Footprints& footprints,
                                       std::span<const TessellationCamera> cameras) const;

  const RuntimeOptions& options_;
  InstanceGeometry& geometry_;
  std::vector<TessellationCamera> cameras_;
  std::vector<TessellationCamera> planned_cameras_;  ///< those of the plan in force
  Needed needed_;                                    ///< under it

  // What of the instances' footprints is right: they are of footprint_cameras_, but for moved_ and from up_to_date_ on.
  std::vector<TessellationCamera> footprint_cameras_;
  size_t up_to_date_ = 0;
  std::vector<uint32_t> moved_;
};

}  // namespace farfield
