// SPDX-License-Identifier: Apache-2.0
// Volumes in memory for tests.
#pragma once

#include <functional>

#include "import/source_volume.h"

namespace farfield::test {

/// dims voxels of this size at the origin, with density(voxel); a voxel with none is empty. White.
inline SourceVolume make_volume(const ivec3& dims, double voxel_size,
                                const std::function<double(const ivec3&)>& density) {
  SourceVolume volume;
  volume.voxel_size = voxel_size;
  volume.dims = dims;
  volume.brick_dims = (dims + (kVolumeBrickSide - 1)) / kVolumeBrickSide;
  volume.brick_table.assign(volume.table_index(volume.brick_dims - 1) + 1, kEmptyBrick);
  for (int z = 0; z < dims.z; ++z)
    for (int y = 0; y < dims.y; ++y)
      for (int x = 0; x < dims.x; ++x) {
        const auto value = static_cast<float>(density({x, y, z}));
        if (!(value > 0)) continue;
        uint32_t& brick = volume.brick_table[volume.table_index(ivec3(x, y, z) / kVolumeBrickSide)];
        if (brick == kEmptyBrick) {
          brick = static_cast<uint32_t>(volume.bricks.size());
          volume.bricks.emplace_back().fill(0);
          ++volume.filled_bricks;
        }
        volume.bricks[brick][index_in_brick({x, y, z})] = value;
        volume.densest = std::max(volume.densest, value);
        ++volume.active_voxels;
      }
  return volume;
}

/// Of a voxel of the grid; 0 in bricks that are not stored and at negative coordinates.
inline float density_at(const SourceVolume& volume, const ivec3& voxel) {
  if (glm::any(glm::lessThan(voxel, ivec3(0)))) return 0;
  const uint32_t brick = volume.brick_at(voxel / kVolumeBrickSide);
  return brick == kEmptyBrick ? 0.0f : volume.bricks[brick][index_in_brick(voxel)];
}

/// Smooth noise in [0, 1], about 6 voxels wide; the same in every run.
inline double smooth_noise(const ivec3& v, double frequency = 1) {
  const dvec3 p = dvec3(v) * frequency;
  const double n = std::sin(0.9 * p.x + 0.3 * p.y) + std::sin(1.1 * p.y - 0.4 * p.z + 1) +
                   std::sin(0.8 * p.z + 0.5 * p.x + 2) + std::sin(0.5 * (p.x + p.y + p.z));
  return 0.125 * (n + 4);
}

}  // namespace farfield::test
