// SPDX-License-Identifier: Apache-2.0
// Which level a ray sees of an instance: a pure function of plan, instance and ray (docs/architecture.md, decisions
// 4 and 7).
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "bvh/traced_asset.h"
#include "farfield/camera.h"
#include "farfield/ray.h"

namespace farfield {

/// What the choice needs to know of an instance.
struct InstanceFootprint {
  float camera_footprint = 0;  ///< world units: the finest that the tessellation cameras have on it
  float world_to_r0 = 0;       ///< pixel_error / instance scale: turns world footprints into local ones
};

/// The usable levels that lambda lies between: `slot`, and `coarser` to the share `blend`. Levels blend over the
/// asset's blend window, at most the octave below the coarser of the two; before that the finer one serves alone.
/// lambda is clamped to what the plan allows and to the root.
struct SlotBlend {
  uint32_t slot;
  uint32_t coarser;  ///< the same at the root
  float blend;       ///< in [0, 1); 0 at the root
};
SlotBlend split_slots(const TracedAsset& asset, float lambda);
/// The same under another plan.
SlotBlend split_slots(const TracedAsset& asset, std::span<const uint8_t> usable, float lambda);

struct LevelChoice {
  uint32_t slot;    ///< stored level
  float blend;      ///< t of its morph to the next; 0: the level alone
  float footprint;  ///< world units: the wider of the camera's on the instance and the ray's cone where it enters
};

/// lambda is that of the wider of the camera's footprint on the instance and the ray's cone where it enters the
/// instance's bounds (t_entry), no finer than the plan allows. Between two usable levels the path sees their morph
/// where the plan has it, else dissolve()d. A ray that leaves a hit on this instance keeps that hit's level and blend.
/// limits hold lambda; forced_lambda replaces it.
LevelChoice choose_level(const TracedAsset& asset, const InstanceFootprint& footprint, const LevelLimits& limits,
                         uint32_t instance, const RayContext& ray, float t_entry,
                         const std::optional<float>& forced_lambda);

/// The coarser of two slots for the share `blend` of paths, decided by path_seed and instance alone, so every ray of a
/// path sees the same one.
uint32_t dissolve(const SlotBlend& slots, uint32_t instance, const RayContext& ray);

/// The lambda of a choice: what was asked for, after the plan's clamp. For hits alone: most choices need no logarithm.
float lambda_of_choice(const TracedAsset& asset, const InstanceFootprint& footprint, const LevelLimits& limits,
                       const LevelChoice& choice, const std::optional<float>& forced_lambda);

}  // namespace farfield
