// SPDX-License-Identifier: Apache-2.0
#include "cache/level_stats.h"

#include <gtest/gtest.h>

#include "cache/level_format.h"
#include "tests/support/level_builder.h"

namespace farfield {
namespace {

TEST(LevelStats, CountWhatASmallLevelHolds) {
  const LevelData level = test::full_level();
  const LevelStats stats = level_stats(view_of(level));
  EXPECT_EQ(stats.vertices, 4u);
  EXPECT_EQ(stats.quads, 2u);
  EXPECT_EQ(stats.faces, 3u);
  EXPECT_DOUBLE_EQ(stats.paired_faces, 2.0 / 3.0);
  EXPECT_EQ(stats.grid, ivec3(16, 8, 8));
  EXPECT_EQ(stats.bricks, 2u);
  EXPECT_EQ(stats.voxels, 5u);
  EXPECT_DOUBLE_EQ(stats.sparsity, 1.0 - 5.0 / 1024.0);
  EXPECT_DOUBLE_EQ(stats.brick_fill, 5.0 / 1024.0);
  EXPECT_DOUBLE_EQ(stats.max_density, 2.5);
  EXPECT_NEAR(stats.mean_density, (265 * 2.5 + 300 * 0.125) / 255.0 / 5.0, 1e-12);
  EXPECT_NEAR(stats.mean_optical_depth, stats.mean_density * 0.25, 1e-12);
}

TEST(LevelStats, DensitiesAreTheMeanOfOctants) {
  LevelData level = test::full_level();
  level.voxel_octants.assign(5, kFullOctants);
  level.voxel_octants[0] = 0x000f;  // a quarter, of the densest
  EXPECT_NEAR(level_stats(view_of(level)).mean_density, ((255 / 4.0 + 10) * 2.5 + 300 * 0.125) / 255.0 / 5.0, 1e-12);
}

TEST(LevelStats, SectionsAddUpToTheFile) {
  for (uint64_t seed = 1; seed < 20; ++seed) {
    const LevelData level = test::random_level(seed, 100, 5);
    uint64_t bytes = 0;
    for (const SectionStats& section : level_stats(view_of(level)).sections) bytes += section.bytes;
    const LevelLayout layout = layout_of(view_of(level));
    const uint64_t overhead = 128 + layout.sections.size() * (40 + 63) + 16 + 64;
    EXPECT_LE(bytes, layout.file_bytes);
    EXPECT_GE(bytes + overhead, layout.file_bytes);
  }
}

TEST(LevelStats, OfSurfaceOrVolumeAloneAreNotDividedByZero) {
  const LevelStats surface = level_stats(view_of(test::random_level(1, 10, 0)));
  EXPECT_EQ(surface.sparsity, 1.0);
  EXPECT_EQ(surface.brick_fill, 0.0);
  EXPECT_EQ(surface.mean_density, 0.0);
  const LevelStats volume = level_stats(view_of(test::random_level(1, 0, 10)));
  EXPECT_EQ(volume.faces, 0u);
  EXPECT_EQ(volume.paired_faces, 0.0);
  EXPECT_GT(volume.mean_density, 0.0);
  EXPECT_LE(volume.mean_density, volume.max_density);
}

}  // namespace
}  // namespace farfield
