// SPDX-License-Identifier: Apache-2.0
#include "prefilter/match_sky.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>

#include "prefilter/measure_volume.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

/// Opaque leaves, of which much light goes on to others.
Surface crown(const vec3& albedo) {
  test::LeafCloud cloud;
  cloud.count = 4000;
  Surface leaves = test::leaf_cloud(cloud);
  for (FaceMaterial& m : leaves.materials) m.diffuse = albedo, m.transmission = m.specular = vec3(0.0f);
  return leaves;
}

/// Leaves, their voxels, and lines through both.
struct Measured {
  explicit Measured(const vec3& albedo) : leaves(crown(albedo)) {
    volume = measure_volume(leaves, {}, {dvec3(leaves.bounds().lower), 0.125}, {.rays_per_voxel = 64}).value();
    geometry.emplace(OpacityScene::build(leaves).value());
    scene.emplace(LineScene::build(*geometry, {}, volume).value());
  }
  dvec3 mean_diffuse() const {
    dvec3 sum(0.0);
    for (const Voxel& voxel : volume.voxels) sum += dvec3(voxel.diffuse);
    return sum / static_cast<double>(volume.voxels.size());
  }

  Surface leaves;
  SparseVolume volume;
  std::optional<OpacityScene> geometry;
  std::optional<LineScene> scene;
};

TEST(MatchSky, FindsAlbedosAgainThatWereMadeDarkerOrBrighter) {
  Measured crown({0.7f, 0.4f, 0.1f});
  ASSERT_GT(crown.volume.voxels.size(), 100u);
  const dvec3 before = crown.mean_diffuse();
  for (const float factor : {0.85f, 1.0f, 1.1f}) {
    Measured changed({0.7f, 0.4f, 0.1f});
    for (Voxel& voxel : changed.volume.voxels) voxel.diffuse *= factor;
    ASSERT_TRUE(match_sky(*changed.scene, changed.volume, {.seed = 5}));
    const dvec3 after = changed.mean_diffuse();
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(after[c] / before[c], 1, 0.02) << factor << " " << c;
  }
}

TEST(MatchSky, LeavesWhiteWhiteAndBlackBlack) {
  Measured crown({1.0f, 1.0f, 0.0f});
  for (const Voxel& voxel : crown.volume.voxels) {
    EXPECT_NEAR(voxel.diffuse.x, 1, 1e-4f);
    EXPECT_EQ(voxel.diffuse.z, 0);
  }
}

TEST(MatchSky, NeedsVoxelsAndCanBeCancelled) {
  Measured crown(vec3(0.5f));
  std::atomic<bool> is_cancelled{true};
  MatchSkyOptions options;
  options.job.cancel = &is_cancelled;
  const auto done = match_sky(*crown.scene, crown.volume, options);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::Cancelled);
  SparseVolume nothing = crown.volume;
  nothing.voxels.clear();
  EXPECT_TRUE(match_sky(*crown.scene, nothing, {}));
}

}  // namespace
}  // namespace farfield
