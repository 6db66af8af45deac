// SPDX-License-Identifier: Apache-2.0
// What rays know of an asset: its levels, those that are loaded, and which of them they may use.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/result.h"
#include "base/vec.h"
#include "bvh/brick_volume.h"
#include "bvh/level_scene.h"

namespace farfield {

/// A loaded level. Immutable; any thread.
struct TracedLevel {
  LevelView view;  ///< the arrays that the BVH and the volume refer to; owned elsewhere, for longer than this
  LevelScene scene;
  BrickVolume volume;
  uint32_t slot = 0;        ///< its index among the asset's stored levels
  uint32_t face_count = 0;  ///< of the surface
  uint32_t voxel_count = 0;

  /// Builds the BVH. Errors: those of LevelScene::build.
  static Result<std::unique_ptr<TracedLevel>> build(BvhDevice& device, const LevelView& level, uint32_t slot) {
    FARFIELD_TRY_LET(auto scene, LevelScene::build(device, level));
    return std::make_unique<TracedLevel>(TracedLevel{level, std::move(scene), BrickVolume(level), slot,
                                                     farfield::face_count(level), farfield::voxel_count(level)});
  }
};

/// An asset, as rays see it. Stored levels ("slots") are ordered finest first. Between two plans only `loaded` changes,
/// from null to a level.
struct TracedAsset {
  Box3 bounds;                ///< contains all levels with room to spare (padded_bounds), local space
  float base_resolution = 0;  ///< r_0 > 0
  uint32_t finest_slot = 0;   ///< the plan: no ray may use a finer one
  /// Per slot: its level, null as long as none was asked for. release/acquire: whoever sees the pointer sees the level.
  std::unique_ptr<std::atomic<const TracedLevel*>[]> loaded;
  std::vector<float> level_numbers;  ///< k of each slot, increasing
  std::vector<vec3> hull;            ///< points whose convex hull contains all levels; empty: the corners of bounds

  uint32_t slot_count() const { return static_cast<uint32_t>(level_numbers.size()); }
  float coarsest_number() const { return level_numbers.back(); }
};

/// The box, a little larger: so that rounding does not clip what lies on its border, also where it is flat.
inline Box3 padded_bounds(const Box3& box) {
  const float far = std::max(max_component(glm::abs(box.lower)), max_component(glm::abs(box.upper)));
  const vec3 pad(1e-5f * max_component(box.size()) + 1e-6f * far);
  return {box.lower - pad, box.upper + pad};
}

/// Serves the levels that rays ask for and that are not loaded.
class LevelSource {
 public:
  virtual ~LevelSource() = default;
  /// The level to use in place of `slot` of `asset` now: waits for it, or gives a coarser one that is there. Null if
  /// there is none at all: the ray then sees nothing. Called from any thread.
  virtual const TracedLevel* serve(uint32_t asset, uint32_t slot) = 0;
};

}  // namespace farfield
