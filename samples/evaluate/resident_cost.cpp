// SPDX-License-Identifier: Apache-2.0
#include "samples/evaluate/resident_cost.h"

#include "bvh/level_scene.h"

namespace farfield {

Result<ResidentCost> measure_resident(const LevelView& level) {
  const auto cost = measure_level_scene(level);
  if (!cost) return tl::unexpected(cost.error());
  return ResidentCost{cost->resident_bytes, cost->build_peak_bytes};
}

}  // namespace farfield
