// SPDX-License-Identifier: Apache-2.0
#include "runtime/explain.h"

#include <algorithm>
#include <limits>

#include "lodselect/footprint.h"

namespace farfield {

namespace {

uint32_t level_of(const TracedAsset& asset, uint32_t slot) { return static_cast<uint32_t>(asset.level_numbers[slot]); }

RayVisit make_visit(const InstanceGeometry& geometry, uint32_t instance, const InstanceGeometry::Entry& entry,
                    const RayContext& context) {
  const InstanceRecord& record = geometry.instances[instance];
  const TracedAsset& asset = *geometry.assets[record.asset];
  const LevelChoice& choice = entry.choice;
  RayVisit visit{};
  visit.instance = {instance};
  visit.asset = {record.asset};
  visit.t_entry = entry.t;
  visit.camera_footprint = record.footprint.camera_footprint;
  visit.ray_footprint = context.width_at(entry.t);
  visit.level_0_footprint = asset.base_resolution / record.footprint.world_to_r0;
  visit.asked_lambda = geometry.forced_lambda.value_or(lambda_of_footprint(
      choice.footprint * record.footprint.world_to_r0, asset.base_resolution, std::numeric_limits<int>::max()));
  visit.lambda = lambda_of_choice(asset, record.footprint, record.limits, choice, geometry.forced_lambda);
  visit.keeps_level = context.origin_instance == instance;
  visit.planned_finest = level_of(asset, asset.finest_slot());
  visit.limits = record.limits;

  const SlotBlend blend = split_slots(asset, visit.lambda);
  visit.is_morph = choice.blend > 0.0f;
  visit.blend = visit.is_morph ? choice.blend : visit.keeps_level ? 0.0f : blend.blend;
  const uint32_t next = visit.is_morph ? choice.slot + 1 : visit.blend > 0.0f ? blend.coarser : choice.slot;
  visit.level = level_of(asset, choice.slot);
  visit.next_level = level_of(asset, next);
  visit.is_loaded = visit.is_morph ? asset.morphs[choice.slot].load(std::memory_order_acquire) != nullptr
                                   : asset.loaded[choice.slot].load(std::memory_order_acquire) != nullptr;
  return visit;
}

}  // namespace

std::vector<RayVisit> explain_ray(const InstanceGeometry& geometry, const EmbreeRay& ray, const RayContext& context) {
  std::vector<RayVisit> visits;
  for (uint32_t instance = 0; instance < geometry.instances.size(); ++instance) {
    if (const auto entry = geometry.entry_of(instance, ray, context))
      visits.push_back(make_visit(geometry, instance, *entry, context));
  }
  std::ranges::stable_sort(visits, {}, &RayVisit::t_entry);
  return visits;
}

}  // namespace farfield
