// SPDX-License-Identifier: Apache-2.0
// The volume of a level, or a part of it, as a piece of work that is named by all that its result depends on. So
// whoever has the same inputs may do it, and whoever finds a file of that name need not.
#pragma once

#include <cstdint>
#include <string>

#include "base/result.h"
#include "cache/level.h"
#include "prefilter/surface.h"
#include "prefilter/voxelize.h"

namespace farfield {

/// Goes up when voxelize() or pack_volume() give other results.
inline constexpr uint32_t kVoxelizeVersion = 6;

/// Refers to the geometry. Immutable; any thread.
struct VolumeJob {
  const Surface& geometry;
  VoxelLattice lattice;
  VoxelizeOptions options;  ///< with the range of bricks; its Job does not count

  /// Hash of the geometry, the lattice, the bricks, the options and the version.
  uint64_t key() const;
  /// "volume_0123456789abcdef.ffl"
  std::string file_name() const;
  /// The packed volume (pack_volume). Errors: those of voxelize().
  Result<LevelData> run() const;
};

}  // namespace farfield
