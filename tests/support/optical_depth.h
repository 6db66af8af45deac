// SPDX-License-Identifier: Apache-2.0
// What a ray meets in a level's volume, by brute force.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/vec.h"
#include "cache/level.h"

namespace farfield::test {

/// The attenuation coefficient that the level really has after packing, towards unit direction w; at a point in voxels,
/// in voxel (x, y, z).
inline double attenuation(const LevelData& level, const glm::dvec3& point, const ivec3& voxel, const vec3& w) {
  const ivec3 n = level.header.brick_dims;
  const ivec3 b = voxel / kBrickSide;
  const uint32_t index = level.brick_table[static_cast<size_t>(b.x + n.x * (b.y + n.y * b.z))];
  if (index == kNoBrick) return 0.0;
  const Brick& brick = level.bricks[index];
  const ivec3 local = voxel - b * kBrickSide;
  const int i = local.x + 8 * (local.y + 8 * local.z);
  const uint8_t density = brick.density[static_cast<size_t>(i)];
  if (density == 0) return 0.0;
  double rho = density / 255.0 * static_cast<double>(brick.density_scale);
  if (!level.voxel_octants.empty()) {
    const glm::dvec3 in_voxel = point - glm::dvec3(voxel);
    const int octant = (in_voxel.x >= 0.5) + 2 * (in_voxel.y >= 0.5) + 4 * (in_voxel.z >= 0.5);
    rho *= static_cast<double>(kOctantShares[level.voxel_octants[brick.payload_index(i)] >> (2 * octant) & 3]);
  }
  if (level.voxel_sggx.empty()) return rho;
  const SymMat3 s = unpack(level.voxel_sggx[brick.payload_index(i)]);
  return rho * std::sqrt(std::max(0.0, static_cast<double>(s.quadratic(w))));
}

/// Optical depth from t = 0 to t_end by brute force: `steps` midpoints.
inline double optical_depth(const LevelData& level, const vec3& origin, const vec3& direction, double t_end,
                            int steps = 20000) {
  const double speed = glm::length(glm::dvec3(direction));
  const vec3 w = direction / static_cast<float>(speed);
  const ivec3 count = level.header.brick_dims * kBrickSide;
  double depth = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double t = t_end * (i + 0.5) / steps;
    const glm::dvec3 p = (glm::dvec3(origin) + t * glm::dvec3(direction) - glm::dvec3(level.header.volume_origin)) /
                         static_cast<double>(level.header.resolution);
    const ivec3 voxel(glm::floor(p));
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis) inside = inside && voxel[axis] >= 0 && voxel[axis] < count[axis];
    if (inside) depth += attenuation(level, p, voxel, w) * speed * t_end / steps;
  }
  return depth;
}

}  // namespace farfield::test
