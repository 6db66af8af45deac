// SPDX-License-Identifier: Apache-2.0
// The BVH of a level's surface: a static Embree scene of quads over the level's own arrays.
#pragma once

#include <cstdint>
#include <memory>

#include "base/embree.h"
#include "base/result.h"
#include "bvh/bvh_device.h"
#include "bvh/part_scenes.h"
#include "cache/level.h"

namespace farfield {

/// A committed Embree scene; nothing for a level without a surface. LevelView::quad_of() tells the quad of a hit's
/// geomID and primID; hits on parts have the number of their place as instID[0]. Movable; any thread may trace it.
class LevelScene {
 public:
  LevelScene() = default;
  /// The level's arrays are shared, not copied: they stay where they are until this is destroyed, but only this call
  /// reads them. Four bytes after the last position must be readable (level files see to that), because Embree loads
  /// vertices 16 bytes at a time. `filter`, if there is one, is asked about every hit, with `user`. terms, errors:
  /// those of build_measured_scene().
  static Result<LevelScene> build(BvhDevice& device, const LevelView& level, const LoadTerms& terms = {},
                                  EmbreeFilter filter = nullptr, void* user = nullptr);

  EmbreeSceneRef handle() const { return built_.scene.get(); }  ///< null without a surface
  uint64_t bytes() const { return built_.bytes + (parts_ ? parts_->bytes() : 0); }
  uint64_t build_peak_bytes() const;

 private:
  std::unique_ptr<PartScenes> parts_;  ///< null without parts; the scene refers to it
  uint64_t most_held_before_ = 0;      ///< at the worst moment of the parts' builds
  MeasuredScene built_;
};

/// The cost of a level in a LevelFile whose build pages were released (LevelFile::release_build_pages), with `scene`.
LevelCost level_cost(const LevelView& level, const LevelScene& scene);

/// Measures a level as the runtime would load it, by building its BVH once. Errors: those of LevelScene::build.
Result<LevelCost> measure_level_scene(BvhDevice& device, const LevelView& level);
/// The same on a device of its own.
Result<LevelCost> measure_level_scene(const LevelView& level);

}  // namespace farfield
