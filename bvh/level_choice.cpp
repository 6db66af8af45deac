// SPDX-License-Identifier: Apache-2.0
#include "bvh/level_choice.h"

#include <algorithm>

#include "base/hash.h"
#include "lodselect/footprint.h"

namespace farfield {

namespace {

/// A slot that rays may use: this one, or the next coarser. A stale record is clamped, not trusted.
uint32_t usable_near(const TracedAsset& asset, uint32_t slot) {
  const auto found = std::ranges::lower_bound(asset.usable_slots, slot);
  return found != asset.usable_slots.end() ? *found : asset.usable_slots.back();
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
  const float world = std::max(footprint.camera_footprint, cone.diameter(t_entry));
  const float coarsest = asset.coarsest_number();
  const float asked = forced_lambda ? std::clamp(*forced_lambda, 0.0f, coarsest)
                                    : lambda_of_footprint(world * footprint.world_to_r0, asset.base_resolution,
                                                          static_cast<int>(coarsest));
  const float lambda = std::max(asked, asset.level_numbers[asset.finest_slot()]);

  if (ray.origin_instance == instance) return {usable_near(asset, ray.origin_level_slot), lambda, world};
  const SlotBlend blend = split_slots(asset, lambda);
  const float u = to_unit_float(mix64(ray.path_seed, instance));
  return {u < blend.blend ? blend.coarser : blend.slot, lambda, world};
}

}  // namespace farfield
