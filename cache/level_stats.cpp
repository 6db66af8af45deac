// SPDX-License-Identifier: Apache-2.0
#include "cache/level_stats.h"

#include <algorithm>

#include "cache/level_format.h"

namespace farfield {

namespace {

/// a / b, or `otherwise` if there is nothing to divide by.
double ratio(double a, double b, double otherwise) { return b > 0 ? a / b : otherwise; }

void add_densities(const LevelView& level, LevelStats& stats) {
  double sum = 0;
  for (const Brick& brick : level.bricks) {
    double brick_sum = 0;
    uint8_t brick_max = 0;
    uint32_t payload = brick.payload_base;
    for (const uint8_t density : brick.density) {
      if (density == 0) continue;
      const float share = level.voxel_octants.empty() ? 1.0f : mean_share(level.voxel_octants[payload]);
      brick_sum += static_cast<double>(density) * static_cast<double>(share);
      brick_max = std::max(brick_max, density);
      ++payload;
    }
    const double unit = static_cast<double>(brick.density_scale) / 255.0;
    sum += brick_sum * unit;
    stats.max_density = std::max(stats.max_density, brick_max * unit);
  }
  stats.mean_density = ratio(sum, static_cast<double>(stats.voxels), 0.0);
  stats.mean_optical_depth = stats.mean_density * static_cast<double>(level.header.resolution);
}

}  // namespace

LevelStats level_stats(const LevelView& level) {
  LevelStats stats;
  stats.vertices = level.positions.size();
  stats.quads = level.quads.size();
  stats.faces = face_count(level);
  stats.paired_faces = ratio(2.0 * static_cast<double>(stats.faces - stats.quads), static_cast<double>(stats.faces), 0);
  stats.grid = level.header.brick_dims * kBrickSide;
  stats.bricks = level.bricks.size();
  stats.voxels = voxel_count(level);
  const auto active = static_cast<double>(stats.voxels);
  stats.sparsity = 1.0 - ratio(active, static_cast<double>(level.brick_table.size()) * kBrickVoxels, 0.0);
  stats.brick_fill = ratio(active, static_cast<double>(stats.bricks) * kBrickVoxels, 0.0);
  add_densities(level, stats);
  for_each_section(level, [&](SectionId id, const auto& array) {
    if (!array.empty()) stats.sections.push_back({section_name(id), array.size(), array.size_bytes()});
  });
  return stats;
}

}  // namespace farfield
