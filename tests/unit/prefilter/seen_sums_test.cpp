// SPDX-License-Identifier: Apache-2.0
#include "prefilter/seen_sums.h"

#include <gtest/gtest.h>

#include "prefilter/density.h"
#include "scattering/normal_moments.h"

namespace farfield {
namespace {

Voxel measured(const SymMat3& s) {
  Voxel voxel;
  voxel.density = 3;
  voxel.sggx = s;
  voxel.diffuse = vec3(0.2f);
  voxel.specular = vec3(0.04f);
  voxel.roughness2 = 0.5f;
  return voxel;
}

FaceMaterial face(const vec3& normal) {
  FaceMaterial m;
  m.sggx = SymMat3::outer(normal);
  m.diffuse = vec3(0.8f, 0.4f, 0.2f);
  m.specular = vec3(0.08f);
  m.roughness2 = 0.1f;
  return m;
}

TEST(SeenSums, OfNothingLeaveTheVoxelAsItIs) {
  Voxel voxel = measured(SymMat3::identity());
  SeenSums().apply(2, voxel);
  EXPECT_NEAR(voxel.density, 3, 1e-5);
  EXPECT_NEAR(voxel.sggx.xx, 1, 1e-6);
  EXPECT_NEAR(voxel.diffuse.x, 0.2f, 1e-7f);
  EXPECT_NEAR(voxel.roughness2, 0.5f, 1e-6f);
}

TEST(SeenSums, AverageWhatIsSeenWithThePrior) {
  Voxel voxel = measured(SymMat3::identity());
  SeenSums sums;
  for (int i = 0; i < 6; ++i) sums.add_hit(face({0, 0, 1}));
  EXPECT_EQ(sums.hits(), 6);
  sums.apply(2, voxel);
  EXPECT_NEAR(voxel.diffuse.x, (2 * 0.2 + 6 * 0.8) / 8, 1e-6);
  EXPECT_NEAR(voxel.diffuse.z, 0.2, 1e-6);
  EXPECT_NEAR(voxel.specular.x, (2 * 0.04 + 6 * 0.08) / 8, 1e-6);
  EXPECT_NEAR(voxel.roughness2, (2 * 0.04 * 0.5 + 6 * 0.08 * 0.1) / (2 * 0.04 + 6 * 0.08), 1e-5);
  const SymMat3 moments = normal_moments(voxel.sggx);
  EXPECT_NEAR(moments.xx / moments.zz, (2.0 / 3) / (2.0 / 3 + 6), 1e-3);
}

TEST(SeenSums, KeepTheMeanAttenuation) {
  for (const SymMat3& own : {SymMat3::identity(), SymMat3::outer({1, 0, 0}), SymMat3{1, 1, 0, 0, 0, 0}}) {
    Voxel voxel = measured(own);
    const double before = voxel.density * mean_opacity(own, 1e-9, 1);
    SeenSums sums;
    for (int i = 0; i < 1000; ++i) sums.add_hit(face({0, 0, 1}));
    sums.apply(2, voxel);
    EXPECT_NEAR(voxel.density * mean_opacity(voxel.sggx, 1e-9, 1) / before, 1, 1e-4);
    EXPECT_NEAR(voxel.sggx.zz, 1, 0.01);
  }
}

}  // namespace
}  // namespace farfield
