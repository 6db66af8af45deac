// SPDX-License-Identifier: Apache-2.0
#include "prefilter/voxel_walk.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "base/random.h"
#include "tests/support/random_unit.h"

namespace farfield {
namespace {

/// A volume of voxels that are there or not by chance, in bricks around the origin that are there or not by chance.
struct RandomVolume {
  SparseVolume volume;
  std::map<std::tuple<int, int, int>, uint32_t> number;  ///< by coordinate

  explicit RandomVolume(uint64_t seed) {
    volume.lattice = {dvec3(0), 1};
    Rng rng(seed);
    for (int i = 0; i < 27; ++i) {
      if (rng.next() < 0.4f) continue;
      VoxelBrick brick{ivec3(i % 3, i / 3 % 3, i / 9) - 1, {}, volume.voxels.size()};
      for (int v = 0; v < kBrickVoxels; ++v) {
        if (rng.next() < 0.5f) continue;
        brick.mask[static_cast<size_t>(v >> 6)] |= uint64_t{1} << (v & 63);
        const ivec3 c = brick.coordinate * kBrickSide + ivec3(v & 7, v >> 3 & 7, v >> 6);
        number[{c.x, c.y, c.z}] = static_cast<uint32_t>(volume.voxels.size());
        volume.voxels.emplace_back();
      }
      volume.bricks.push_back(brick);
    }
  }
};

TEST(VoxelGrid, FindsEachStoredVoxelAndNoOther) {
  const RandomVolume volume(3);
  const VoxelGrid grid(volume.volume);
  for (int z = -20; z < 20; ++z) {
    for (int y = -20; y < 20; ++y) {
      for (int x = -20; x < 20; ++x) {
        const auto stored = volume.number.find({x, y, z});
        const auto found = grid.find({x, y, z});
        ASSERT_EQ(found.has_value(), stored != volume.number.end());
        if (found) {
          ASSERT_EQ(*found, stored->second);
        }
      }
    }
  }
  EXPECT_FALSE(VoxelGrid(SparseVolume{}).find(ivec3(0)));
}

using Visits = std::vector<std::pair<uint32_t, double>>;  ///< voxel, length in it

Visits walk(const VoxelGrid& grid, const VoxelRay& ray) {
  Visits visits;
  double last = ray.near;
  grid.walk(ray, [&](uint32_t voxel, double enter, double leave) {
    EXPECT_LT(enter, leave);
    EXPECT_GE(enter, last);
    last = leave;
    visits.emplace_back(voxel, leave - enter);
    return true;
  });
  EXPECT_LE(last, std::max(ray.near, ray.far));
  return visits;
}

/// The same by small steps.
std::map<uint32_t, double> step_through(const RandomVolume& volume, const VoxelRay& ray) {
  constexpr int kSteps = 40000;
  std::map<uint32_t, double> lengths;
  const double step = (ray.far - ray.near) / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const ivec3 c(glm::floor(ray.origin + (ray.near + (i + 0.5) * step) * ray.direction));
    if (const auto found = volume.number.find({c.x, c.y, c.z}); found != volume.number.end()) {
      lengths[found->second] += step;
    }
  }
  return lengths;
}

TEST(VoxelWalk, PassesTheVoxelsThatSmallStepsPass) {
  const RandomVolume volume(3);
  const VoxelGrid grid(volume.volume);
  Rng rng(4);
  for (int i = 0; i < 50; ++i) {
    const VoxelRay ray{24.0 * (dvec3(rng.next(), rng.next(), rng.next()) - 0.5), dvec3(test::random_unit(rng)), 0, 50};
    const std::map<uint32_t, double> expected = step_through(volume, ray);
    double seen = 0, sum = 0;
    for (const auto& [voxel, length] : walk(grid, ray)) {
      const auto found = expected.find(voxel);
      EXPECT_NEAR(length, found == expected.end() ? 0 : found->second, 5e-3) << i;
      seen += length;
    }
    for (const auto& [voxel, length] : expected) sum += length;
    EXPECT_NEAR(seen, sum, 0.02) << i;
  }
}

TEST(VoxelWalk, GoesAlongAxesAndInTheWallsOfVoxels) {
  const RandomVolume volume(5);
  const VoxelGrid grid(volume.volume);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      for (const double beside : {0.5, 0.0, 3.0}) {  // 0: the ray runs in walls of voxels and of bricks
        VoxelRay ray{dvec3(beside), dvec3(0), 0, 100};
        ray.origin[axis] = -50 * sign;
        ray.direction[axis] = sign;
        for (const auto& [voxel, length] : walk(grid, ray)) EXPECT_NEAR(length, 1, 1e-9);
        if (beside != 0.5) continue;
        EXPECT_EQ(walk(grid, ray).size(), step_through(volume, ray).size());
      }
    }
  }
}

TEST(VoxelWalk, StopsWhenAsked) {
  const RandomVolume volume(6);
  const VoxelGrid grid(volume.volume);
  int visits = 0;
  grid.walk({dvec3(-20, 0.5, 0.5), dvec3(1, 0, 0), 0, 100}, [&](uint32_t, double, double) { return ++visits < 3; });
  EXPECT_EQ(visits, 3);
}

TEST(VoxelWalk, FindsNothingInNothingNorInRaysThatAreEmptyOrNoNumbers) {
  EXPECT_TRUE(walk(VoxelGrid(SparseVolume{}), {dvec3(0), dvec3(1, 0, 0), 0, 10}).empty());
  const VoxelGrid grid(RandomVolume(7).volume);
  EXPECT_TRUE(walk(grid, {dvec3(0.5), dvec3(1, 0, 0), 5, 5}).empty());
  EXPECT_TRUE(walk(grid, {dvec3(0.5), dvec3(1, 0, 0), 5, 2}).empty());
  EXPECT_TRUE(walk(grid, {dvec3(1e9), dvec3(1, 0, 0), 0, 10}).empty());
  int visits = 0;
  const auto count = [&](uint32_t, double, double) { return ++visits < 1000; };
  grid.walk({dvec3(std::nan("")), dvec3(1, 0, 0), 0, 10}, count);
  grid.walk({dvec3(0), dvec3(std::nan("")), 0, 10}, count);
  EXPECT_LT(visits, 1000);  // it comes to an end
}

TEST(VoxelGrid, HasTheBoxOfItsStoredVoxels) {
  SparseVolume volume;
  volume.lattice = {dvec3(0), 1};
  VoxelBrick brick{ivec3(-1, 0, 2), {}, 0};
  brick.mask[3] = uint64_t{1} << (5 + 8 * 6);
  volume.bricks = {brick};
  volume.voxels.resize(1);
  const VoxelBox box = VoxelGrid(volume).box();
  EXPECT_EQ(box.lower, dvec3(-3, 6, 19));
  EXPECT_EQ(box.upper, dvec3(-2, 7, 20));
}

}  // namespace
}  // namespace farfield
