// SPDX-License-Identifier: Apache-2.0
// Why these choices (quads, MEDIUM quality, default flags, shared buffers): docs/architecture.md, decision 2, and
// bvh_bench. COMPACT would halve the speed on foliage; Embree cannot load a saved BVH.
#include "bvh/level_scene.h"

#include <fmt/format.h>

#include <vector>

#include "base/result.h"
#include "cache/level_file.h"

namespace farfield {

Result<LevelScene> LevelScene::build(BvhDevice& device, const LevelView& level, const LoadTerms& terms,
                                     EmbreeFilter filter, void* user) {
  LevelScene result;
  if (!level.has_surface()) return result;
  const auto make = [&] {
    std::vector<EmbreeGeometry> geometries;
    geometries.push_back(new_quads(device.handle()));
    const EmbreeGeometryRef quads = geometries.back().get();
    share_array(quads, level.positions);
    share_array(quads, level.quads);
    if (filter) set_filter(quads, filter, user);
    return geometries;
  };
  FARFIELD_TRY_LET(result.built_,
                   build_measured_scene(device, make, terms, fmt::format("the BVH of {} quads", level.quads.size())));
  return result;
}

LevelCost level_cost(const LevelView& level, const LevelScene& scene) {
  const LevelFileSizes file = level_file_sizes(level);
  return {file.memory_bytes - file.build_only_bytes + scene.bytes(), file.build_only_bytes + scene.build_peak_bytes()};
}

Result<LevelCost> measure_level_scene(BvhDevice& device, const LevelView& level) {
  // A LevelData has nothing behind its last position: see LevelScene::build.
  std::vector<vec3> padded_positions(level.positions.begin(), level.positions.end());
  padded_positions.emplace_back(0.0f);
  LevelView padded = level;
  padded.positions = std::span<const vec3>(padded_positions.data(), level.positions.size());

  FARFIELD_TRY_LET(const auto scene, LevelScene::build(device, padded));
  return level_cost(level, scene);
}

Result<LevelCost> measure_level_scene(const LevelView& level) {
  FARFIELD_TRY_LET(const auto device, BvhDevice::create());
  return measure_level_scene(*device, level);
}

}  // namespace farfield
