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
    if (!(footprint > 0.5f * coarser)) return usable[i];  // also for NaN
    if (footprint < coarser) return {};
  }
  return usable.back();
}

}  // namespace

SlotBlend split_slots(const TracedAsset& asset, float lambda) {
  const std::vector<uint8_t>& usable = asset.usable_slots;
  size_t i = 0;
  while (i + 1 < usable.size() && asset.level_numbers[usable[i + 1]] <= lambda) ++i;
  if (i + 1 == usable.size()) return {usable[i], usable[i], 0.0f};
  // A level that is not there saves nothing over the finer one, which serves in its place.
  const float coarser = asset.level_numbers[usable[i + 1]];
  return {usable[i], usable[i + 1], std::max(0.0f, lambda - (coarser - 1))};
}

LevelChoice choose_level(const TracedAsset& asset, const InstanceFootprint& footprint, uint32_t instance,
                         const RayContext& ray, float t_entry, const std::optional<float>& forced_lambda) {
  const RayCone cone{ray.cone_width, ray.cone_spread};
  LevelChoice choice{0, std::max(footprint.camera_footprint, cone.diameter(t_entry))};
  if (ray.origin_instance == instance) {
    choice.slot = usable_near(asset, ray.origin_level_slot);
    return choice;
  }
  if (!forced_lambda) {
    if (const auto slot = only_slot(asset, footprint_in_r0(asset, footprint, choice.footprint))) {
      choice.slot = *slot;
      return choice;
    }
  }
  const SlotBlend blend = split_slots(asset, lambda_of_choice(asset, footprint, choice, forced_lambda));
  const float u = to_unit_float(mix64(ray.path_seed, instance));
  choice.slot = u < blend.blend ? blend.coarser : blend.slot;
  return choice;
}

float lambda_of_choice(const TracedAsset& asset, const InstanceFootprint& footprint, const LevelChoice& choice,
                       const std::optional<float>& forced_lambda) {
  const float coarsest = asset.coarsest_number();
  const float asked = forced_lambda ? std::clamp(*forced_lambda, 0.0f, coarsest)
                                    : lambda_of_footprint(choice.footprint * footprint.world_to_r0,
                                                          asset.base_resolution, static_cast<int>(coarsest));
  return std::max(asked, asset.level_numbers[asset.finest_slot()]);
}

}  // namespace farfield
