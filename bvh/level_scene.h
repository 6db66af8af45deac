// SPDX-License-Identifier: Apache-2.0
// The BVH of a level's surface: a static Embree scene of quads over the level's own arrays.
#pragma once

#include <cstdint>
#include <limits>

#include "base/embree.h"
#include "base/result.h"
#include "bvh/bvh_device.h"
#include "cache/level.h"

namespace farfield {

/// What Embree does not report: scene objects, geometry objects and malloc's rounding, measured on 3.13.5.
inline constexpr uint64_t kSceneOverheadBytes = 3072;
inline constexpr uint64_t kGeometryOverheadBytes = 300;

/// As much memory as there is.
inline constexpr uint64_t kAnyBytes = std::numeric_limits<uint64_t>::max();

/// A committed Embree scene of one quad geometry with geomID 0 and primID = index of the quad; nothing for a level
/// without a surface. Movable; any thread may trace it.
class LevelScene {
 public:
  LevelScene() = default;
  /// Builds on the calling thread alone, so that the same level always takes the same bytes. The level's arrays are
  /// shared, not copied: they stay where they are until this is destroyed, but only this call reads them. Four bytes
  /// after the last position must be readable (level files see to that), because Embree loads vertices 16 bytes at a
  /// time. Embree gets no more than `most_bytes`, at the worst moment. `filter`, if there is one, is asked about every
  /// hit, with `user`. Holds device.build_mutex(). Errors: OutOfBudget (most_bytes are not enough), Io (out of memory,
  /// or what else Embree says).
  static Result<LevelScene> build(BvhDevice& device, const LevelView& level, uint64_t most_bytes = kAnyBytes,
                                  EmbreeFilter filter = nullptr, void* user = nullptr);

  EmbreeSceneRef handle() const { return scene_.get(); }  ///< null without a surface
  /// Bytes that the BVH holds, overheads included.
  uint64_t bytes() const { return bytes_; }
  /// Bytes that the build needed at its peak beyond bytes().
  uint64_t build_peak_bytes() const { return build_peak_bytes_; }

 private:
  EmbreeScene scene_;
  uint64_t bytes_ = 0;
  uint64_t build_peak_bytes_ = 0;
};

/// The cost of a level in a LevelFile whose build pages were released (LevelFile::release_build_pages), with `scene`.
LevelCost level_cost(const LevelView& level, const LevelScene& scene);

/// Measures a level as the runtime would load it, by building its BVH once. Errors: those of LevelScene::build.
Result<LevelCost> measure_level_scene(BvhDevice& device, const LevelView& level);
/// The same on a device of its own.
Result<LevelCost> measure_level_scene(const LevelView& level);

}  // namespace farfield
