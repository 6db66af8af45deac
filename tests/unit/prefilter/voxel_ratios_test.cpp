// SPDX-License-Identifier: Apache-2.0
#include "prefilter/voxel_ratios.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

/// Bricks of two voxels each.
SparseVolume bricks(int count) {
  SparseVolume volume;
  for (int b = 0; b < count; ++b) {
    VoxelBrick brick{ivec3(b, 0, 0), {}, volume.voxels.size()};
    brick.mask[1] = 3;
    volume.bricks.push_back(brick);
    volume.voxels.resize(volume.voxels.size() + 2);
  }
  return volume;
}

TEST(ShrunkRatios, AreOneWithoutRays) {
  for (const double r : shrunk_ratios(bricks(2), std::vector<SourceAndMedium>(4), 2)) EXPECT_EQ(r, 1);
  EXPECT_TRUE(shrunk_ratios({}, {}, 2).empty());
}

TEST(ShrunkRatios, AreTheVoxelsOwnWhereMuchIsSeenAndTheirBricksElsewhere) {
  std::vector<SourceAndMedium> sums(4);
  sums[0].source.add(2e6), sums[0].medium.add(1e6);  // brick 0: 2
  sums[2].source.add(1e6), sums[2].medium.add(2e6);  // brick 1: a half
  sums[3].source.add(1), sums[3].medium.add(1);
  const std::vector<double> ratios = shrunk_ratios(bricks(2), sums, 2);
  EXPECT_NEAR(ratios[0], 2, 1e-5);
  EXPECT_NEAR(ratios[1], 2, 1e-5);
  EXPECT_NEAR(ratios[2], 0.5, 1e-5);
  EXPECT_NEAR(ratios[3], (1 + 2 * 0.5) / (1 + 2), 1e-5);
}

TEST(ShrunkRatios, OfASourceThatIsNeverHitArePositive) {
  std::vector<SourceAndMedium> sums(2);
  sums[0].medium.add(1e9);
  for (const double r : shrunk_ratios(bricks(1), sums, 2)) EXPECT_GT(r, 0);
}

}  // namespace
}  // namespace farfield
