// SPDX-License-Identifier: Apache-2.0
#include "bake/volume_job.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/surfaces.h"

namespace farfield {
namespace {

TEST(VolumeJob, IsNamedByAllThatItsResultDependsOn) {
  const Surface leaves = test::leaf_cloud({});
  Surface moved = leaves, recoloured = leaves, rewired = leaves;
  moved.positions[0].x += 1e-3f;
  recoloured.materials[0].diffuse.y += 0.1f;
  std::swap(rewired.triangles[0].x, rewired.triangles[0].y);
  const VoxelLattice lattice{dvec3(0), 1.0 / 16};
  const VoxelizeOptions options;

  std::set<std::string> names = {VolumeJob{leaves, lattice, options}.file_name()};
  const auto add = [&](const VolumeJob& job) { return names.insert(job.file_name()).second; };
  EXPECT_FALSE(add({leaves, lattice, options}));
  VoxelizeOptions observed = options;
  observed.job.progress = [](double, const std::string&) {};
  EXPECT_FALSE(add({leaves, lattice, observed}));
  EXPECT_TRUE(add({moved, lattice, options}) && add({recoloured, lattice, options}) &&
              add({rewired, lattice, options}));
  EXPECT_TRUE(add({leaves, {dvec3(0, 1, 0), 1.0 / 16}, options}) && add({leaves, {dvec3(0), 1.0 / 8}, options}));
  EXPECT_TRUE(add({leaves, lattice, {.rays_per_voxel = 201}}) && add({leaves, lattice, {.seed = 1}}));
  EXPECT_TRUE(add({leaves, lattice, {.bricks = {0, 1}}}) && add({leaves, lattice, {.bricks = {1, 1}}}));
}

TEST(VolumeJob, PartsGiveTogetherWhatTheWholeGives) {
  const Surface leaves = test::leaf_cloud({});
  const VoxelLattice lattice{dvec3(0), 1.0 / 32};
  const auto whole = voxelize(leaves, lattice, {});
  ASSERT_TRUE(whole);
  const uint64_t count = candidate_bricks(leaves, lattice);
  ASSERT_GT(count, 8u);
  size_t brick = 0, voxel = 0;
  for (const BrickRange range : {BrickRange{0, 5}, {5, count - 7}, {count - 2, ~uint64_t{0}}, {count, 3}}) {
    const auto part = voxelize(leaves, lattice, {.bricks = range});
    ASSERT_TRUE(part);
    for (const VoxelBrick& of_part : part->bricks) {
      ASSERT_LT(brick, whole->bricks.size());
      EXPECT_EQ(of_part.coordinate, whole->bricks[brick].coordinate);
      EXPECT_EQ(of_part.mask, whole->bricks[brick].mask);
      ++brick;
    }
    for (const Voxel& of_part : part->voxels) {
      ASSERT_LT(voxel, whole->voxels.size());
      EXPECT_EQ(of_part.density, whole->voxels[voxel].density);
      EXPECT_EQ(of_part.diffuse, whole->voxels[voxel].diffuse);
      ++voxel;
    }
  }
  EXPECT_EQ(brick, whole->bricks.size());
  EXPECT_EQ(voxel, whole->voxels.size());
}

}  // namespace
}  // namespace farfield
