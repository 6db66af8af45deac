// SPDX-License-Identifier: Apache-2.0
#include "prefilter/octants.h"

#include <gtest/gtest.h>

#include "prefilter/measure_volume.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using test::leaf_cloud;
using test::LeafCloud;

/// Leaves in the lower half of every layer of voxels of this size.
Surface leaves_in_layers(float voxel_size) {
  LeafCloud cloud;
  cloud.count = 6000, cloud.leaf_size = 0.01f;
  Surface leaves = leaf_cloud(cloud);
  for (size_t i = 0; i < leaves.positions.size(); i += 4) {  // four corners of a leaf
    const float z = 0.5f * (leaves.positions[i].z + leaves.positions[i + 2].z);
    const float layer = std::floor(z / voxel_size);
    const float wanted = voxel_size * (layer + 0.1f + 0.3f * (z / voxel_size - layer));
    for (size_t k = i; k < i + 4; ++k) leaves.positions[k].z += wanted - z;
  }
  return leaves;
}

double share_of_half(const SparseVolume& volume, int upper) {
  double sum = 0, all = 0;
  for (const Voxel& v : volume.voxels) {
    for (int o = 0; o < 8; ++o) {
      const double amount = v.density * octant_share(v.octants, o);
      all += amount;
      if (o >> 2 == upper) sum += amount;
    }
  }
  return sum / all;
}

TEST(MeasureOctants, FindsTheHalfThatGeometryIsIn) {
  const float size = 1.0f / 4;
  const auto volume = measure_volume(leaves_in_layers(size), {}, {dvec3(0), size}, {});
  ASSERT_TRUE(volume.has_value());
  EXPECT_GT(share_of_half(*volume, 0), 0.97);
}

TEST(MeasureOctants, LeavesFullWhatIsEvenlyFilled) {
  LeafCloud cloud;
  cloud.count = 20000, cloud.leaf_size = 0.01f;
  const auto volume = measure_volume(leaf_cloud(cloud), {}, {dvec3(0), 1.0 / 2}, {});
  ASSERT_TRUE(volume.has_value());
  EXPECT_NEAR(share_of_half(*volume, 0), 0.5, 0.06);
  double mean = 0;
  for (const Voxel& v : volume->voxels) mean += mean_share(v.octants);
  EXPECT_GT(mean / double(volume->voxels.size()), 0.6);
}

TEST(MeasureOctants, StopsWhenToldTo) {
  const Surface leaves = leaf_cloud({});
  const auto geometry = OpacityScene::build(leaves);
  ASSERT_TRUE(geometry.has_value());
  auto volume = voxelize(*geometry, {dvec3(0), 1.0 / 4}, {});
  ASSERT_TRUE(volume.has_value());
  const auto scene = LineScene::build(*geometry, {}, *volume);
  ASSERT_TRUE(scene.has_value());
  std::atomic<bool> cancel = true;
  const auto done = measure_octants(*scene, *volume, {100000, 1, {{}, &cancel}});
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace farfield
