// SPDX-License-Identifier: Apache-2.0
#include "bvh/level_choice.h"

#include <algorithm>
#include <bit>

#include "base/hash.h"
#include "lodselect/footprint.h"

namespace farfield {

namespace {

/// A slot that rays may use: this one, or the next coarser. A stale record is clamped, not trusted.
uint32_t usable_near(const TracedAsset& asset, uint32_t slot) {
  const auto found = std::ranges::lower_bound(asset.usable_slots, slot);
  return found != asset.usable_slots.end() ? *found : asset.usable_slots.back();
}

float footprint_in_r0(const TracedAsset& asset, const InstanceFootprint& footprint, float world) {
  return world * footprint.world_to_r0 / asset.base_resolution;
}

/// 2^k, for the whole numbers that levels have.
float width_of_level(float k) {
  return std::bit_cast<float>(static_cast<uint32_t>(127 + static_cast<int>(std::min(k, 127.0f))) << 23);
}

/// The usable level that a footprint, in units of r_0, sees alone; none where it sees two.
std::optional<uint32_t> only_slot(const TracedAsset& asset, float footprint) {
  const std::vector<uint8_t>& usable = asset.usable_slots;
  for (size_t i = 0; i + 1 < usable.size(); ++i) {
    const float coarser = width_of_level(asset.level_numbers[usable[i + 1]]);
    if (!(footprint > asset.finest_blended * coarser)) return usable[i];  // also for NaN
    if (footprint < coarser) return {};
  }
  return usable.back();
}

/// A morph's t; 0 where it is as good as one of the levels, so that 1 / t and 1 / (1 - t) stay sane. Also for NaN.
float blend_of(float t) {
  constexpr float kLeast = 0x1p-20f;
  return t >= kLeast && t <= 1 - kLeast ? t : 0.0f;
}

}  // namespace

SlotBlend split_slots(const TracedAsset& asset, float lambda) { return split_slots(asset, asset.usable_slots, lambda); }

SlotBlend split_slots(const TracedAsset& asset, std::span<const uint8_t> usable, float lambda) {
  size_t i = 0;
  while (i + 1 < usable.size() && asset.level_numbers[usable[i + 1]] <= lambda) ++i;
  if (i + 1 == usable.size()) return {usable[i], usable[i], 0.0f};
  // A level that is not there saves nothing over the finer one, which serves in its place.
  const float coarser = asset.level_numbers[usable[i + 1]];
  return {usable[i], usable[i + 1], std::max(0.0f, lambda - (coarser - asset.blend_window)) / asset.blend_window};
}

uint32_t dissolve(const SlotBlend& slots, uint32_t instance, const RayContext& ray) {
  return to_unit_float(mix64(ray.path_seed, instance)) < slots.blend ? slots.coarser : slots.slot;
}

LevelChoice choose_level(const TracedAsset& asset, const InstanceFootprint& footprint, const LevelLimits& limits,
                         uint32_t instance, const RayContext& ray, float t_entry,
                         const std::optional<float>& forced_lambda) {
  LevelChoice choice{0, 0.0f, std::max(footprint.camera_footprint, ray.width_at(t_entry))};
  if (ray.origin_instance == instance) {
    choice.slot = usable_near(asset, ray.origin_level_slot);
    if (choice.slot == ray.origin_level_slot && asset.may_morph(choice.slot)) choice.blend = blend_of(ray.origin_blend);
    return choice;
  }
  if (!forced_lambda) {
    const float width = std::clamp(footprint_in_r0(asset, footprint, choice.footprint), width_of_level(limits.finest),
                                   width_of_level(limits.coarsest));
    if (const auto slot = only_slot(asset, width)) {
      choice.slot = *slot;
      return choice;
    }
  }
  const SlotBlend blend = split_slots(asset, lambda_of_choice(asset, footprint, limits, choice, forced_lambda));
  if (asset.may_morph(blend.slot)) {
    choice.blend = blend_of(blend.blend);
    choice.slot = blend.blend > 0.5f && choice.blend == 0 ? blend.coarser : blend.slot;
  } else {
    choice.slot = dissolve(blend, instance, ray);
  }
  return choice;
}

float lambda_of_choice(const TracedAsset& asset, const InstanceFootprint& footprint, const LevelLimits& limits,
                       const LevelChoice& choice, const std::optional<float>& forced_lambda) {
  const float coarsest = asset.coarsest_number();
  float asked;
  if (forced_lambda) {
    asked = std::clamp(*forced_lambda, 0.0f, coarsest);
  } else {
    asked = lambda_of_footprint(choice.footprint * footprint.world_to_r0, asset.base_resolution,
                                static_cast<int>(coarsest));
    asked = std::clamp(asked, std::min<float>(limits.finest, coarsest), std::min<float>(limits.coarsest, coarsest));
  }
  return std::max(asked, asset.level_numbers[asset.finest_slot()]);
}

}  // namespace farfield
