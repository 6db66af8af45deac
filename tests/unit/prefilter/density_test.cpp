// SPDX-License-Identifier: Apache-2.0
#include "prefilter/density.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace farfield {
namespace {

SymMat3 diagonal(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z), 0, 0, 0};
}

vec3 random_direction(Rng& rng) {
  const float z = 2 * rng.next() - 1, angle = 2 * kPi * rng.next(), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

TEST(OpticalDepthOfHits, IsTheLogOfTheShareThatGetsThrough) {
  EXPECT_EQ(optical_depth_of_hits(0, 200), 0);
  EXPECT_NEAR(optical_depth_of_hits(100, 200), std::log(2.0), 1e-12);
  EXPECT_NEAR(optical_depth_of_hits(200, 200), std::log(400.0), 1e-12);  // clamped, never infinite
  EXPECT_NEAR(optical_depth_of_hits(1, 1), std::log(2.0), 1e-12);
}

TEST(SolveDensity, IsOpticalDepthOverLengthForIsotropicFlakes) {
  for (const double tau : {1e-6, 0.01, 0.3, 1.0, 3.0, 8.0}) {
    for (const double length : {1e-3, 1.0, 50.0}) {
      EXPECT_NEAR(solve_density(SymMat3::identity(), tau, length) * length / tau, 1, 1e-6) << tau << " " << length;
      // S = 1/4 I has sigma = 1/2.
      EXPECT_NEAR(solve_density(diagonal(0.25, 0.25, 0.25), tau, length) * length / tau, 2, 2e-6);
    }
  }
}

TEST(SolveDensity, InvertsTheClosedFormOfParallelFlakes) {
  // All flakes have one normal: sigma = |cos|, so the mean transmittance is (1 - exp(-x)) / x.
  const SymMat3 planar = SymMat3::outer(glm::normalize(vec3(1, -2, 3)));
  for (const double x : {1e-5, 0.01, 0.1, 0.5, 1.0, 3.0, 10.0, 50.0}) {
    const double tau = -std::log(-std::expm1(-x) / x);
    EXPECT_NEAR(solve_density(planar, tau, 2.0) * 2.0 / x, 1, 1e-3) << x;
  }
}

TEST(SolveDensity, InvertsTheMeanOpacityOfAnyDistribution) {
  // Agreement of two quadratures: the solver takes fewer nodes for thin media than mean_opacity does.
  Rng rng(3);
  for (int i = 0; i < 2000; ++i) {
    const SymMat3 s = diagonal(1, std::pow(rng.next(), 4), std::pow(rng.next(), 8));
    const double tau = 6 * std::pow(rng.next(), 3) + 1e-4;
    const double rho = solve_density(s, tau, 0.5);
    EXPECT_NEAR(-std::log1p(-mean_opacity(s, rho, 0.5)) / tau, 1, 2e-4) << s.yy << " " << s.zz << " " << tau;
  }
}

TEST(SolveDensity, AgreesWithDirectionsDrawnAtRandom) {
  Rng rng(4);  // 4e5 directions: standard error of the mean below 0.0008
  for (const SymMat3& s : {diagonal(1, 1, 0), diagonal(1, 0.3, 0.01), diagonal(1, 0, 0), diagonal(1, 1, 1)}) {
    const double rho = solve_density(s, 1.2, 3.0);
    double sum = 0;
    constexpr int kCount = 400000;
    for (int i = 0; i < kCount; ++i) sum += std::exp(-rho * 3.0 * std::sqrt(s.quadratic(random_direction(rng))));
    EXPECT_NEAR(sum / kCount, std::exp(-1.2), 0.003);
  }
}

TEST(SolveDensity, ScalesWithTheMatrix) {
  const SymMat3 s = {0.5f, 0.3f, 0.2f, 0.1f, -0.05f, 0.02f};
  EXPECT_NEAR(solve_density(s * 0.04f, 0.7, 1.0), 5 * solve_density(s, 0.7, 1.0), 1e-4);
}

TEST(SolveDensity, NeverDecreasesWithOpticalDepth) {
  for (const SymMat3& s : {SymMat3::identity(), diagonal(1, 1e-4, 1e-4), diagonal(1, 0.9, 1e-6)}) {
    double previous = 0;
    for (double tau = 1e-3; tau < 12; tau *= 1.01) {
      const double rho = solve_density(s, tau, 1.0);
      // Where the number of nodes changes, the quadrature error shows: allow a ten-thousandth.
      EXPECT_GE(rho, previous * (1 - 1e-4));
      previous = rho;
    }
  }
}

TEST(SolveDensity, IsZeroWithoutHitsAndCappedWithoutMisses) {
  EXPECT_EQ(solve_density(SymMat3::identity(), 0, 1.0), 0);
  EXPECT_EQ(solve_density(SymMat3{}, 0, 1.0), 0);
  EXPECT_EQ(solve_density(SymMat3{}, 1, 1.0), 0);
  const double rho = solve_density(SymMat3::outer(vec3(0, 0, 2)), 1e6, 0.5);
  EXPECT_DOUBLE_EQ(rho, kMaxDensityLength / (0.5 * 2));
}

}  // namespace
}  // namespace farfield
