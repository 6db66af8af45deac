// SPDX-License-Identifier: Apache-2.0
#include "bake/level_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/file_io.h"
#include "bvh/level_scene.h"
#include "bvh/ray_cost.h"
#include "bvh/traced_morph.h"
#include "cache/level_file.h"
#include "cache/placed_parts.h"

namespace farfield {
namespace {

/// All vertices and stored voxels of a level.
void add_to_hull(const LevelView& level, SlabHull& hull) {
  for_each_surface_point(level, [&](const vec3& point) { hull.add(point); });
  const float voxel_size = level.header.resolution;
  for_each_brick(level, [&](const Brick& brick, const ivec3& coordinates) {
    const Box3 voxels = active_box(brick);
    const vec3 corner = level.header.volume_origin + vec3(coordinates * kBrickSide) * voxel_size;
    hull.add(Box3{corner + voxels.lower * voxel_size, corner + voxels.upper * voxel_size});
  });
}

}  // namespace

LevelWriter::LevelWriter(std::filesystem::path folder, MeasureLevel measure, Manifest& manifest)
    : folder_(std::move(folder)), measure_(std::move(measure)), manifest_(manifest) {}

Result<bool> LevelWriter::write(const LevelView& level, uint32_t grid, uint64_t most_bytes) {
  if (!level.has_surface() && !level.has_volume()) return false;  // too thin for any ray to have hit it
  FARFIELD_TRY_LET(const auto cost, measure_ ? measure_(level) : measure_level_scene(level));
  if (cost.resident_bytes > most_bytes) return false;

  LevelEntry entry;
  entry.level = level.header.level;
  entry.resolution = std::ldexp(manifest_.base_resolution, static_cast<int>(entry.level));
  entry.grid = grid;
  entry.file = fmt::format("level_{}.ffl", entry.level);
  entry.triangles = face_count(level);
  entry.placements = level.placements.size();
  entry.voxels = voxel_count(level);
  entry.bricks = level.bricks.size();
  entry.resident_bytes = cost.resident_bytes;
  entry.build_peak_bytes = cost.build_peak_bytes;
  entry.ray_cost = level.has_parts() ? ray_cost(view_of(flattened(level))) : ray_cost(level);
  const std::filesystem::path path = folder_ / entry.file;
  FARFIELD_TRY_LET(entry.file_bytes, write_level(path, level));
  FARFIELD_TRY_LET(entry.file_hash, hash_file(path));
  if (!manifest_.levels.empty()) {
    FARFIELD_TRY_LET(entry.morph, measure_morph_to(level));
  }
  manifest_.levels.push_back(entry);
  add_to_hull(level, hull_);
  return true;
}

Result<std::optional<LevelCost>> LevelWriter::measure_morph_to(const LevelView& level) const {
  FARFIELD_TRY_LET(const auto finer, LevelFile::open(folder_ / manifest_.levels.back().file, LevelCheck::Structure));
  if (finer->view().has_parts()) return std::nullopt;  // rays see one of the two
  FARFIELD_TRY_LET(const LevelCost cost, measure_morph(finer->view(), level));
  return cost;
}

Result<void> LevelWriter::finish() {
  manifest_.hull = hull_.corners();
  for (const vec3& corner : manifest_.hull) manifest_.bounds.extend(corner);
  return write_manifest(folder_, manifest_);
}

uint64_t most_bytes_after(uint64_t bytes, bool is_root) {
  return is_root ? bytes - std::min<uint64_t>(bytes, 1) : bytes - bytes / 10;
}

}  // namespace farfield
