// SPDX-License-Identifier: Apache-2.0
#include "scattering/hot_spot.h"

#include <gtest/gtest.h>

#include "scattering/flake_phase.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

/// The mean of L over the cosine lobe, by the midpoint rule.
double mean_over_lobe(double normal_cosine) {
  constexpr int n = 400;
  const vec3 wo(dvec3(std::sqrt(1 - normal_cosine * normal_cosine), 0, normal_cosine));
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const vec3 wi =
          cosine_lobe(vec3(0, 0, 1), (static_cast<float>(i) + 0.5f) / n, (static_cast<float>(j) + 0.5f) / n);
      sum += hot_spot_lobe(glm::dot(wo, wi));
    }
  }
  return sum / (n * n);
}

TEST(HotSpot, MeanOfTheLobeIsItsIntegral) {
  for (int i = -8; i <= 8; ++i)
    EXPECT_NEAR(mean_hot_spot_lobe(static_cast<float>(i) / 8), mean_over_lobe(i / 8.0), 1.2e-3) << i;
}

TEST(HotSpot, IsHighestTowardsTheViewerAndNeverNegative) {
  for (const float normal_cosine : {-1.0f, -0.3f, 0.0f, 0.5f, 1.0f}) {
    float last = 1e9f;
    for (const float phase_cosine : {1.00001f, 1.0f, 0.9f, 0.3f, 0.0f, -0.7f, -1.0f}) {
      EXPECT_EQ(hot_spot(0, phase_cosine, normal_cosine), 1);
      const float factor = hot_spot(kStrongestHotSpot, phase_cosine, normal_cosine);
      EXPECT_TRUE(factor >= 0 && factor <= last) << phase_cosine << ' ' << normal_cosine;
      last = factor;
    }
  }
}

// Within 5 standard errors of 100000 samples and the fit of the mean.
TEST(HotSpot, TakesNoLightAndAddsNone) {
  Rng rng(1);
  for (const NamedSggx& s : sample_sggx()) {
    for (const float through : {0.0f, 0.4f}) {
      for (const float specular : {0.0f, 0.04f}) {
        FlakeParams p;
        p.sggx = s.sggx, p.diffuse = vec3(1 - through), p.transmission = vec3(through), p.specular = vec3(specular);
        p.roughness2 = 0.2f, p.hot_spot = 0.3f;
        const FlakePhase phase(p, vec3(random_direction(rng)));
        const Mean albedo = mean_of(100000, 2, [&](Rng& r) { return phase.sample(r).weight; });
        EXPECT_NEAR(albedo.value.x, 1, 5 * albedo.standard_error.x + 5e-3) << s.name << through << specular;
      }
    }
  }
}

TEST(HotSpot, OfFlakesSendsLightBackToItsSide) {
  for (const NamedSggx& s : sample_sggx()) {
    FlakeParams p;
    p.sggx = s.sggx, p.diffuse = vec3(0.5f);
    const vec3 wo = glm::normalize(vec3(0.3f, -0.5f, 0.8f)), wi = glm::normalize(vec3(0.4f, -0.4f, 0.8f));
    const auto eval = [&](float strength) {
      p.hot_spot = strength;
      return mean_of(2000, 3, [&](Rng& r) { return FlakePhase(p, wo).eval(wi, r); }).value.x;
    };
    EXPECT_GT(eval(0.2f), 1.05 * eval(0)) << s.name;
  }
}

}  // namespace
}  // namespace farfield
