// SPDX-License-Identifier: Apache-2.0
// The volume of a level as a piece of work that is named by all that its result depends on. So whoever has the same
// inputs may do it, and whoever finds a file of that name need not.
#pragma once

#include <cstdint>
#include <string>

#include "base/result.h"
#include "cache/level.h"
#include "prefilter/measure_volume.h"
#include "prefilter/surface.h"

namespace farfield {

/// Goes up when measure_volume() or pack_volume() give other results.
inline constexpr uint32_t kVoxelizeVersion = 19;

/// Refers to the surfaces. Immutable; any thread.
struct VolumeJob {
  const Surface& geometry;
  const Surface& macrosurface;
  VoxelLattice lattice;
  VolumeOptions options;  ///< its Job does not count

  /// Hash of both surfaces, the lattice, the options and the version.
  uint64_t key() const;
  /// "volume_0123456789abcdef.ffl"
  std::string file_name() const;
  /// The packed volume (pack_volume). Errors: those of measure_volume().
  Result<LevelData> run() const;
};

}  // namespace farfield
