// SPDX-License-Identifier: Apache-2.0
// What `farfield info` tells about a level beyond the manifest: how its bytes are spent and how full its grid is.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "cache/level.h"

namespace farfield {

/// One array of a level.
struct SectionStats {
  std::string_view name;  ///< as the fields of LevelArrays are called
  uint64_t count = 0;
  uint64_t bytes = 0;
};

struct LevelStats {
  uint64_t vertices = 0;
  uint64_t quads = 0;
  uint64_t faces = 0;
  double paired_faces = 0;  ///< fraction of faces that share a quad with another: fewer, faster BVH leaves
  ivec3 grid{0};            ///< voxels along x, y, z that the brick table spans
  uint64_t bricks = 0;
  uint64_t voxels = 0;      ///< active
  double sparsity = 0;      ///< fraction of the grid's voxels that are empty; 1 without volume
  double brick_fill = 0;    ///< fraction of the stored bricks' voxels that are active
  double mean_density = 0;  ///< over active voxels, 1 / local unit
  double max_density = 0;
  double mean_optical_depth = 0;       ///< of one active voxel: mean_density * resolution
  std::vector<SectionStats> sections;  ///< those present, in file order
};

/// Reads the bricks once. Pure; any thread.
LevelStats level_stats(const LevelView& level);

}  // namespace farfield
