// SPDX-License-Identifier: Apache-2.0
// Why these choices (quads, MEDIUM quality, default flags, shared buffers): docs/architecture.md, decision 2, and
// bvh_bench. COMPACT would halve the speed on foliage; Embree cannot load a saved BVH.
#include "bvh/level_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "base/bytes.h"
#include "base/result.h"
#include "cache/level_file.h"

namespace farfield {

Result<LevelScene> LevelScene::build(BvhDevice& device, const LevelView& level, uint64_t most_bytes,
                                     EmbreeFilter filter, void* user) {
  LevelScene result;
  if (!level.has_surface()) return result;

  const std::lock_guard lock(device.build_mutex());
  const uint64_t bytes_before = device.bytes();
  device.reset_peak();
  forget_embree_error(device.handle());  // not ours

  const EmbreeGeometry quads = new_quads(device.handle());
  share_array(quads.get(), level.positions);
  share_array(quads.get(), level.quads);
  if (filter) set_filter(quads.get(), filter, user);
  constexpr uint64_t kOverheadBytes = kSceneOverheadBytes + kGeometryOverheadBytes;
  const uint64_t most_of_embree = most_bytes - std::min(most_bytes, kOverheadBytes);
  device.set_limit(bytes_before + std::min(most_of_embree, kAnyBytes - bytes_before));
  result.scene_ = build_static_scene(device.handle(), quads.get());
  if (device.end_limit()) {
    forget_embree_error(device.handle());
    return make_error(ErrorCode::OutOfBudget, fmt::format("the BVH of {} quads takes more than {}", level.quads.size(),
                                                          format_bytes(most_bytes)));
  }
  FARFIELD_TRY(check_embree(device.handle(), fmt::format("build a BVH of {} quads", level.quads.size())));

  const uint64_t bytes_after = device.bytes();
  result.bytes_ = bytes_after - std::min(bytes_before, bytes_after) + kOverheadBytes;
  result.build_peak_bytes_ = device.peak_bytes() - bytes_after;
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
