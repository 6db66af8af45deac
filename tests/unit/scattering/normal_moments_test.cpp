// SPDX-License-Identifier: Apache-2.0
#include "scattering/normal_moments.h"

#include <gtest/gtest.h>

#include "scattering/sggx.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

void expect_near(const SymMat3& a, const SymMat3& b, double tolerance, const std::string& what) {
  const SymMat3 d = a + b * -1.0f;
  for (const float x : {d.xx, d.yy, d.zz, d.xy, d.xz, d.yz}) EXPECT_NEAR(x, 0, tolerance) << what;
}

TEST(NormalMoments, AreThoseOfSampledNormals) {
  for (const NamedSggx& named : sample_sggx()) {
    const Sggx sggx(named.sggx);
    Rng rng(3);
    glm::dmat3 sum(0.0);
    constexpr int n = 40000;
    for (int i = 0; i < n; ++i) {
      const dvec3 m(sggx.sample_normal(rng));
      sum += glm::outerProduct(m, m) / double{n};
    }
    const auto f = [&](int i, int j) { return static_cast<float>(sum[i][j]); };
    expect_near(normal_moments(named.sggx), {f(0, 0), f(1, 1), f(2, 2), f(1, 0), f(2, 0), f(2, 1)}, 0.01, named.name);
  }
}

TEST(NormalMoments, LeadBackToTheirMatrix) {
  for (const NamedSggx& named : sample_sggx()) {
    const SymMat3 s = named.sggx * static_cast<float>(1 / eigenvalues(named.sggx).x);
    expect_near(sggx_of_moments(normal_moments(s)), s, 1e-3, named.name);
    expect_near(sggx_of_moments(normal_moments(s) * 1e-12f), s, 1e-3, named.name);
  }
}

TEST(NormalMoments, OfFlatRoundAndFibrousFlakesAreTheirMatrix) {
  const vec3 n = glm::normalize(vec3(0.3f, -0.5f, 0.8f));
  const SymMat3 fibres = SymMat3::identity() + SymMat3::outer(n) * -1.0f;
  expect_near(sggx_of_moments(SymMat3::outer(n)), SymMat3::outer(n), 1e-6, "flat");
  expect_near(sggx_of_moments(SymMat3::identity()), SymMat3::identity(), 1e-6, "round");
  expect_near(sggx_of_moments(fibres), fibres, 1e-6, "fibres");
  EXPECT_EQ(sggx_of_moments(SymMat3{}), SymMat3{});
}

TEST(NormalMoments, AreSoundForAnyMoments) {
  Rng rng(5);
  for (int i = 0; i < 3000; ++i) {
    SymMat3 m;
    const int normals = 1 + static_cast<int>(rng.next() * 4);
    for (int k = 0; k < normals; ++k)
      m += SymMat3::outer(vec3(random_direction(rng))) * std::pow(10.0f, -8 * rng.next());
    const dvec3 eigen = eigenvalues(sggx_of_moments(m));
    EXPECT_TRUE(eigen.z >= 0 && std::abs(eigen.x - 1) < 1e-4) << eigen.x << ' ' << eigen.z;
    EXPECT_LE(eigen.y, eigenvalues(m).y / eigenvalues(m).x * 1.001 + 1e-6);  // flatter, never rounder
  }
}

}  // namespace
}  // namespace farfield
