// SPDX-License-Identifier: Apache-2.0
#include "prefilter/thin_out.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prefilter/density.h"

namespace farfield {
namespace {

/// Full bricks in a row whose voxels all have this density.
SparseVolume filled(int bricks, float density, const SymMat3& sggx = SymMat3::identity()) {
  SparseVolume volume;
  volume.lattice = {dvec3(0), 1};
  for (int b = 0; b < bricks; ++b) {
    VoxelBrick brick{ivec3(b, 0, 0), {}, volume.voxels.size()};
    brick.mask.fill(~uint64_t{0});
    volume.bricks.push_back(brick);
    Voxel voxel;
    voxel.density = density;
    voxel.sggx = sggx;
    volume.voxels.resize(volume.voxels.size() + kBrickVoxels, voxel);
  }
  return volume;
}

double total_density(const SparseVolume& volume) {
  double sum = 0;
  for (const Voxel& v : volume.voxels) sum += v.density;
  return sum;
}

TEST(ThinOut, KeepsTheSumOfFaintVoxelsUpToOneOfEachBrick) {
  for (const SymMat3& s : {SymMat3::identity(), SymMat3::outer({0, 0, 1})}) {
    const SparseVolume volume = filled(4, 0.006f, s);
    const SparseVolume thin = thin_out(volume, 1);
    EXPECT_LT(thin.voxels.size(), 0.4 * double(volume.voxels.size()));
    double least = 1;
    for (const Voxel& v : thin.voxels) least = std::min(least, -std::log1p(-mean_opacity(v.sggx, v.density, 1.0)));
    EXPECT_GT(least, 0.99 * kFaintestDepth);
    EXPECT_NEAR(total_density(thin), total_density(volume), 4 * 0.05);
  }
}

// One octant of eight: a voxel whose density seems enough is not.
TEST(ThinOut, CountsWhatOctantsLeaveEmpty) {
  SparseVolume volume = filled(4, 0.05f);
  for (Voxel& v : volume.voxels) v.octants = 0x0003;
  const SparseVolume thin = thin_out(volume, 1);
  EXPECT_LT(thin.voxels.size(), 0.4 * double(volume.voxels.size()));
  for (const Voxel& v : thin.voxels) EXPECT_EQ(v.octants, 0x0003);
  EXPECT_NEAR(total_density(thin), total_density(volume), 4 * 8 * 0.05);
}

TEST(ThinOut, LeavesVoxelsThatAreNotFaint) {
  const SparseVolume volume = filled(2, 0.5f);
  const SparseVolume thin = thin_out(volume, 1);
  ASSERT_EQ(thin.voxels.size(), volume.voxels.size());
  for (const Voxel& v : thin.voxels) EXPECT_EQ(v.density, 0.5f);
}

// A brick stores its densities in 255 steps, none of them 0: what is below one step would be stored too dense.
TEST(ThinOut, GivesVoxelsBelowTheStepOfTheirBrickThatStepOrNothing) {
  SparseVolume volume = filled(1, 0.2f);
  volume.voxels[100].density = 255;
  const double before = total_density(volume);
  const SparseVolume thin = thin_out(volume, 1);
  EXPECT_NEAR(total_density(thin), before, 1);
  for (const Voxel& v : thin.voxels) EXPECT_GE(v.density, 0.999f);
}

TEST(ThinOut, DropsEmptyBricksAndNumbersTheRest) {
  SparseVolume volume = filled(3, 1e-9f);
  for (size_t i = 0; i < 64; ++i) volume.voxels[kBrickVoxels + i].density = 1;  // word 0 of brick 1
  const SparseVolume thin = thin_out(volume, 1);
  ASSERT_EQ(thin.bricks.size(), 1u);
  EXPECT_EQ(thin.bricks[0].coordinate, ivec3(1, 0, 0));
  EXPECT_EQ(thin.bricks[0].first_voxel, 0u);
  EXPECT_EQ(thin.bricks[0].mask[0], ~uint64_t{0});
  EXPECT_EQ(thin.bricks[0].mask[1], 0u);
  EXPECT_EQ(thin.voxels.size(), 64u);
  EXPECT_TRUE(thin_out({}, 1).bricks.empty());
}

}  // namespace
}  // namespace farfield
