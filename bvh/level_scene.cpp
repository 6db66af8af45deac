// SPDX-License-Identifier: Apache-2.0
// Why these choices (quads, MEDIUM quality, default flags, shared buffers): docs/architecture.md, decision 2, and
// bvh_bench. COMPACT would halve the speed on foliage; Embree cannot load a saved BVH.
#include "bvh/level_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "base/result.h"
#include "cache/level_file.h"

namespace farfield {

Result<LevelScene> LevelScene::build(BvhDevice& device, const LevelView& level, const LoadTerms& terms,
                                     EmbreeFilter filter, void* user) {
  LevelScene result;
  if (!level.has_surface()) return result;
  LoadTerms left = terms;
  if (level.has_parts()) {
    FARFIELD_TRY_LET(auto parts, PartScenes::build(device, level, terms, filter, user));
    result.parts_ = std::make_unique<PartScenes>(std::move(parts));
    result.most_held_before_ = result.parts_->most_held_bytes();
    left = terms.after(result.parts_->bytes());
  }
  const auto make = [&] {
    std::vector<EmbreeGeometry> geometries(1);
    const auto own = level.quads.first(level.own_quad_count());
    if (!own.empty()) geometries[0] = make_quads(device, level, own, filter, user);
    if (result.parts_) geometries.push_back(result.parts_->make_geometry(device.handle()));
    return geometries;
  };
  FARFIELD_TRY_LET(result.built_,
                   build_measured_scene(device, make, left, fmt::format("the BVH of {} quads", level.quads.size())));
  if (result.parts_) {
    const uint64_t with_points = result.parts_->bytes();
    result.parts_->forget_points();
    result.built_.build_peak_bytes += with_points - result.parts_->bytes();
  }
  return result;
}

uint64_t LevelScene::build_peak_bytes() const {
  return std::max(built_.build_peak_bytes, most_held_before_ - std::min(most_held_before_, bytes()));
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
