// SPDX-License-Identifier: Apache-2.0
#include "prefilter/surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prefilter/measure_volume.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using namespace test;

const vec3 kUp(0, 0, 1);

FaceMaterial with_shading_normal(const vec3& normal) {
  FaceMaterial m;
  m.sggx = SymMat3::outer(kUp);
  m.shading_sggx = SymMat3::outer(normal);
  return m;
}

vec3 tilted(float degrees) { return {std::sin(degrees * kPi / 180), 0, std::cos(degrees * kPi / 180)}; }

TEST(FlakeNormals, AreThoseThatLightSees) {
  for (const float degrees : {0.0f, 10.0f, 29.0f}) {
    const FaceMaterial m = with_shading_normal(tilted(degrees));
    EXPECT_EQ(m.flake_normals(), m.shading_sggx) << degrees;
  }
}

TEST(FlakeNormals, AreTheFacesOwnWhereTheSourceHasNoOthers) {
  FaceMaterial m = with_shading_normal(kUp);
  m.shading_sggx = {};
  EXPECT_EQ(m.flake_normals(), m.sggx);
  EXPECT_EQ(FaceMaterial().flake_normals(), SymMat3());
}

TEST(FlakeNormals, AreBentByThirtyDegreesAtMost) {
  for (const float degrees : {31.0f, 45.0f, 90.0f, 150.0f - 1}) {
    const SymMat3 s = with_shading_normal(tilted(degrees)).flake_normals();
    EXPECT_NEAR(s.trace(), 1, 1e-5f) << degrees;
    EXPECT_NEAR(s.quadratic(kUp), 0.75f, 1e-5f) << degrees;
  }
}

// A face with a spread of normals is as spread as its shading normals: neither bends the other.
TEST(FlakeNormals, OfSpreadNormalsAreThatSpread) {
  FaceMaterial m;
  m.sggx = m.shading_sggx = SymMat3::identity() * (1.0f / 3);
  EXPECT_NEAR(m.flake_normals().xx, 1.0f / 3, 1e-6f);
}

/// Share of the vertical in the moments of a leaf cloud's flakes.
double upright_share(const Surface& leaves) {
  const auto volume = measure_volume(leaves, {}, {dvec3(0), 1.0 / 4}, {.rays_per_voxel = 100});
  double up = 0, all = 0;
  for (const Voxel& v : volume->voxels) up += v.density * v.sggx.zz, all += v.density * v.sggx.trace();
  return up / all;
}

// As quads that are folded along their diagonal have it, or leaves smoothed by a modeller.
TEST(FlakeNormals, OfVolumesAreThoseThatLightSees) {
  LeafCloud cloud;
  cloud.count = 3000, cloud.leaf_size = 0.02f;
  Surface leaves = leaf_cloud(cloud);
  const double without = upright_share(leaves);
  for (FaceMaterial& m : leaves.materials) {
    vec3 normal = glm::normalize(vec3(m.sggx.xz, m.sggx.yz, m.sggx.zz) + vec3(1e-6f));
    normal = glm::normalize(normal + 0.3f * kUp);
    m.shading_sggx = SymMat3::outer(normal);
  }
  EXPECT_GT(upright_share(leaves), without + 0.03);
}

}  // namespace
}  // namespace farfield
