// SPDX-License-Identifier: Apache-2.0
#include "scattering/media/sggx_filter.h"

#include <gtest/gtest.h>

#include "scattering/carlson.h"
#include "scattering/sggx.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

double mean_extinction(const SggxFlakes& f) {
  const dvec3 l = eigenvalues(f.sggx);
  return f.rho * carlson_rg(l.x, l.y, l.z);
}

TEST(SggxAverage, KeepsTheMeanAttenuation) {
  Rng rng(1);
  SggxAverage average;
  double expected = 0, weights = 0;
  for (const NamedSggx& s : sample_sggx()) {
    const SggxFlakes flakes{normalise_sggx(s.sggx).sggx, 5 * rng.next()};
    const float weight = rng.next();
    average.add(flakes, weight);
    expected += weight * mean_extinction(flakes), weights += weight;
  }
  const SggxFlakes result = average.result();
  EXPECT_NEAR(mean_extinction(result), expected / weights, 1e-5 * expected);
  EXPECT_NEAR(eigenvalues(result.sggx).x, 1, 1e-6);
}

TEST(SggxAverage, OfEqualVoxelsIsTheVoxel) {
  const SymMat3 s = sggx_from({1, 0.3, 0.01}, {1, 2, 3});
  SggxAverage average;
  for (int i = 0; i < 8; ++i) average.add({s * 4.0f, 1.5f}, 0.125f);
  const vec3 w = glm::normalize(vec3(0.3f, 1, -1));
  const SggxFlakes result = average.result();
  EXPECT_NEAR(result.rho * Sggx(result.sggx).sigma(w), 3 * Sggx(s).sigma(w), 1e-5);
}

TEST(SggxAverage, EmptyVoxelsDiluteAndNothingIsNothing) {
  SggxAverage average;
  EXPECT_EQ(average.result().rho, 0);
  average.add({}, 1);
  EXPECT_EQ(average.result().rho, 0);
  average.add({SymMat3::identity(), 2}, 1);
  EXPECT_NEAR(average.result().rho, 1, 1e-6);
}

TEST(SggxAverage, StaysPositiveSemidefinite) {
  Rng rng(2);
  for (int i = 0; i < 2000; ++i) {
    const SggxFlakes a{SymMat3::outer(vec3(random_direction(rng))), rng.next()};
    const SggxFlakes b{SymMat3::outer(vec3(random_direction(rng))), 1e3f * rng.next()};
    const SggxFlakes c = lerp(a, b, rng.next());
    for (int k = 0; k < 10; ++k) EXPECT_GE(c.sggx.quadratic(vec3(random_direction(rng))), -2e-7f);
  }
}

TEST(SggxLerp, MeetsItsEnds) {
  const SggxFlakes a{SymMat3::outer({1, 0, 0}), 2}, b{SymMat3::identity(), 1};
  EXPECT_NEAR(lerp(a, b, 0).rho, 2, 1e-6);
  EXPECT_NEAR(lerp(a, b, 1).rho, 1, 1e-6);
  EXPECT_EQ(lerp(a, b, 1).sggx, b.sggx);
  EXPECT_NEAR(lerp(a, {}, 0.25f).rho, 1.5, 1e-6);
}

}  // namespace
}  // namespace farfield
