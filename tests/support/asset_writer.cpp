// SPDX-License-Identifier: Apache-2.0
#include "tests/support/asset_writer.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "base/file_io.h"
#include "base/hash.h"
#include "cache/level_file.h"
#include "cache/level_format.h"
#include "tests/support/level_builder.h"

namespace farfield::test {

namespace {

template <typename T>
T or_stop(Result<T> result) {
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    std::abort();
  }
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// More than the file, as the runtime's answer would be; for readers of manifests, who build no scene.
LevelCost assumed_cost(const LevelView& level) {
  return {round_up(layout_of(level).file_bytes, kPageBytes) + 1000, 100};
}

/// Writes a level's file, fills in what its entry says of it, extends the asset's bounds by it.
void write_entry(const std::filesystem::path& folder, const LevelData& level, const MeasureLevel& measure,
                 LevelEntry& entry, Box3& bounds) {
  const LevelCost cost = measure(view_of(level));
  entry.level = level.header.level;
  entry.resolution = level.header.resolution;
  entry.file = "level_" + std::to_string(entry.level) + ".ffl";
  entry.file_bytes = or_stop(write_level(folder / entry.file, level));
  entry.file_hash = or_stop(hash_file(folder / entry.file));
  entry.triangles = face_count(level);
  entry.placements = level.placements.size();
  entry.voxels = voxel_count(level);
  entry.bricks = level.bricks.size();
  entry.resident_bytes = cost.resident_bytes;
  entry.build_peak_bytes = cost.build_peak_bytes;
  bounds.extend(level.header.bounds);
}

}  // namespace

Manifest write_asset(const std::filesystem::path& folder, const std::vector<LevelData>& levels,
                     const MeasureLevel& measure, dvec3 origin, const MeasureMorph& measure_morph) {
  std::filesystem::create_directories(folder);
  Manifest manifest;
  manifest.generator = "test";
  manifest.source = "test.obj";
  manifest.origin = origin;
  manifest.base_resolution = std::ldexp(levels[0].header.resolution, -static_cast<int>(levels[0].header.level));
  for (const LevelData& level : levels) {
    LevelEntry& entry = manifest.levels.emplace_back();
    entry.grid = 1;
    write_entry(folder, level, measure, entry, manifest.bounds);
    const bool may_morph = &level != &levels[0] && !(&level - 1)->has_parts();
    if (measure_morph && may_morph) entry.morph = measure_morph(view_of(*(&level - 1)), view_of(level));
  }
  or_stop(write_manifest(folder, manifest));
  return manifest;
}

Manifest sample_manifest() {
  Manifest manifest;
  manifest.generator = "farfield 0.1.0";
  manifest.source = "oak.glb";
  manifest.source_hash = 0x0123456789abcdefull;
  manifest.options = "finest_grid=512";
  manifest.origin = {1e7, -2.5, 0.1};
  manifest.bounds = {vec3(-1.0f, -2.0f, -3.0f), vec3(0.1f, 0.2f, 0.3f)};
  manifest.base_resolution = 0.125;
  manifest.hull = {{-1.0f, -2.0f, -3.0f}, {0.1f, 0.2f, 0.3f}};
  for (const uint32_t k : {0u, 1u, 3u}) {
    LevelEntry level;
    level.level = k;
    level.resolution = 0.125 * (1 << k);
    level.grid = 32u >> k;
    level.file = "level_" + std::to_string(k) + ".ffl";
    level.file_bytes = 1000 + k;
    level.file_hash = mix64(k);
    level.triangles = 100 - k;
    level.voxels = 10 * k;
    level.bricks = k;
    level.resident_bytes = 4096 * (4 - k);
    level.build_peak_bytes = 100 * (4 - k);
    if (k == 1) level.errors = LevelErrors{-0.01, 0.02, 0.03};
    manifest.levels.push_back(level);
  }
  return manifest;
}

Manifest write_sample_asset(const std::filesystem::path& folder) {
  Manifest manifest = sample_manifest();
  manifest.bounds = Box3{};
  manifest.hull.clear();
  LevelData finer;
  for (LevelEntry& entry : manifest.levels) {
    LevelData level = random_level(entry.level + 1, 50u >> entry.level, entry.level);
    level.header.level = entry.level;
    level.header.resolution = static_cast<float>(entry.resolution);
    level.header.bounds = Box3{};
    level.header.volume_origin = vec3(0.0f);
    extend_by_volume(level.header);
    for (const vec3& position : level.positions) level.header.bounds.extend(position);
    level.morph_vertex.assign(finer.positions.size(), 0);
    level.morph_face.assign(face_count(view_of(finer)), kMorphCollapsed);
    write_entry(folder, level, assumed_cost, entry, manifest.bounds);
    finer = std::move(level);
  }
  const vec3 corners[] = {manifest.bounds.lower, manifest.bounds.upper};
  for (size_t i = 0; i < 8; ++i) {
    manifest.hull.emplace_back(corners[i & 1].x, corners[i >> 1 & 1].y, corners[i >> 2].z);
  }
  or_stop(write_manifest(folder, manifest));
  return manifest;
}

}  // namespace farfield::test
