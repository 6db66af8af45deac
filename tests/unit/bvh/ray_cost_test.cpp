// SPDX-License-Identifier: Apache-2.0
#include "bvh/ray_cost.h"

#include <gtest/gtest.h>

#include "tests/support/level_builder.h"

namespace farfield {
namespace {

RayWork work_of(const LevelData& level) { return count_ray_work(view_of(level)); }

/// A cube of 4^3 bricks, side 3.2, of one density.
LevelData cube_of(float density) {
  LevelData level = test::empty_level(3, 0.1f);
  test::set_volume(level, ivec3(4), vec3(-1.6f), [=](int, int, int) { return density; });
  test::extend_by_volume(level.header);
  return level;
}

TEST(RayCost, NothingCostsNothingButTheRay) {
  const RayWork work = work_of(test::empty_level(0, 0.1f));
  EXPECT_EQ(work.boxes + work.quads + work.bricks + work.voxels + work.collisions, 0.0);
  EXPECT_GT(ray_cost(work), 0.0);
}

TEST(RayCost, IsTheSameEachTime) {
  const LevelData level = test::random_level(3, 500, 20);
  EXPECT_EQ(ray_cost(view_of(level)), ray_cost(view_of(level)));
}

TEST(RayCost, FinerSurfacesCostMoreByTheLogarithm) {
  const RayWork coarse = work_of(test::sphere_level(vec3(0.0f), 1.0f, 16));
  const RayWork fine = work_of(test::sphere_level(vec3(0.0f), 1.0f, 64));
  EXPECT_GT(fine.boxes, 1.2 * coarse.boxes);
  EXPECT_LT(fine.boxes, 2.5 * coarse.boxes);  // 16 times the quads, 4 binary levels more
  EXPECT_GT(coarse.quads, 1.0);
  EXPECT_LT(fine.quads, 40.0);  // a tree that prunes nothing would test 4096
  EXPECT_EQ(fine.bricks, 0.0);
}

TEST(RayCost, SoupCostsMoreThanASphereOfAsManyQuads) {
  const RayWork soup = work_of(test::triangle_soup(4000, 0.1f, 1));
  const RayWork sphere = work_of(test::sphere_level(vec3(0.0f), 1.0f, 45));
  EXPECT_GT(ray_cost(soup), ray_cost(sphere));
}

TEST(RayCost, VoxelsAreCountedUntilTheRayIsStopped) {
  const RayWork thick = work_of(cube_of(40.0f)), dense = work_of(cube_of(8.0f));
  EXPECT_GT(dense.voxels, 2 * thick.voxels);  // mean free paths of 0.5 and 2.5 voxels
  EXPECT_GT(thick.voxels, 0.5);
  EXPECT_LT(dense.bricks, 4.0);
  EXPECT_GT(thick.collisions, 0.5);
  EXPECT_LT(thick.collisions, 2.5);  // two of flakes of mean area 1/2
}

TEST(RayCost, FaintBricksAreNotWalkedVoxelByVoxel) {
  const RayWork faint = work_of(cube_of(0.1f));
  EXPECT_EQ(faint.voxels, 0.0);
  EXPECT_GT(faint.bricks, 0.5);  // only by those who could collide
  EXPECT_LT(faint.collisions, 0.5);
  EXPECT_GT(faint.collisions, 0.05);
}

}  // namespace
}  // namespace farfield
