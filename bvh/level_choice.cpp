// SPDX-License-Identifier: Apache-2.0
#include "bvh/level_choice.h"

#include <algorithm>

#include "base/hash.h"
#include "lodselect/footprint.h"

namespace farfield {

SlotBlend split_slots(const TracedAsset& asset, float lambda) {
  uint32_t slot = asset.finest_slot;
  while (slot + 1 < asset.slot_count() && asset.level_numbers[slot + 1] <= lambda) ++slot;
  if (slot + 1 == asset.slot_count()) return {slot, 0.0f};
  // A level that is not stored saves nothing over the finer one, which serves in its place.
  const float coarser = asset.level_numbers[slot + 1];
  return {slot, std::max(0.0f, lambda - (coarser - 1))};
}

LevelChoice choose_level(const TracedAsset& asset, const InstanceFootprint& footprint, uint32_t instance,
                         const RayContext& ray, float t_entry, const std::optional<float>& forced_lambda) {
  const RayCone cone{ray.cone_width, ray.cone_spread};
  const float world = std::max(footprint.camera_footprint, cone.diameter(t_entry));
  const float coarsest = asset.coarsest_number();
  const float asked = forced_lambda ? std::clamp(*forced_lambda, 0.0f, coarsest)
                                    : lambda_of_footprint(world * footprint.world_to_r0, asset.base_resolution,
                                                          static_cast<int>(coarsest));
  const float lambda = std::max(asked, asset.level_numbers[asset.finest_slot]);

  if (ray.origin_instance == instance) {
    const auto kept = std::clamp<uint32_t>(ray.origin_level_slot, asset.finest_slot, asset.slot_count() - 1);
    return {kept, lambda, world};
  }
  const SlotBlend blend = split_slots(asset, lambda);
  const float u = to_unit_float(mix64(ray.path_seed, instance));
  return {u < blend.blend ? blend.slot + 1 : blend.slot, lambda, world};
}

}  // namespace farfield
