// SPDX-License-Identifier: Apache-2.0
// What the tessellation cameras ask of each asset, and the plan that fits the budget.
#pragma once

#include <optional>
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

 private:
  struct TexturedPlan : Plan {
    uint64_t texture_bytes = 0;
  };
  Result<TexturedPlan> plan_with_textures(LevelStore& levels) const;
  void update_footprints(const std::vector<TessellationCamera>& of_cameras);
  void update_footprint(uint32_t instance, const std::vector<TessellationCamera>& of_cameras);
  float wanted_lambda(const InstanceRecord& instance) const;
  std::vector<PlanAsset> wanted_assets(const LevelStore& levels) const;

  const RuntimeOptions& options_;
  InstanceGeometry& geometry_;
  std::vector<TessellationCamera> cameras_;
  std::vector<TessellationCamera> planned_cameras_;  ///< those of the plan in force

  // What of the instances' footprints is right: they are of footprint_cameras_, but for moved_ and from up_to_date_ on.
  std::vector<TessellationCamera> footprint_cameras_;
  size_t up_to_date_ = 0;
  std::vector<uint32_t> moved_;
};

}  // namespace farfield
