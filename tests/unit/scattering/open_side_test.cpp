// SPDX-License-Identifier: Apache-2.0
#include "scattering/open_side.h"

#include <gtest/gtest.h>

#include "scattering/albedo.h"
#include "scattering/flake_phase.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

TEST(OpenSide, MultipliesDarkSidesAndLeavesWhiteOnes) {
  const vec3 up(0, 0, 1), open_side(0, 0, 0.2f);
  const vec3 gain = odds_gain(vec3(0.0f, 0.5f, 1.0f), side_opening(open_side, up));
  EXPECT_NEAR(gain.x, 1.2f, 1e-6f);
  EXPECT_GT(gain.y, 1.05f);
  EXPECT_LT(gain.y, 1.2f);
  EXPECT_NEAR(gain.z, 1, 1e-6f);
  EXPECT_NEAR(side_opening(open_side, -up), 0.8f, 1e-6f);
  EXPECT_EQ(side_opening(vec3(0.0f), up), 1.0f);
}

TEST(OpenSide, GivesNoAlbedoAboveOne) {
  Rng rng(4);
  for (int i = 0; i < 1000; ++i) {
    const vec3 open_side = kMostOpenSide * vec3(random_direction(rng)), normal(random_direction(rng));
    const float base = rng.next();
    const float albedo = base * odds_gain(vec3(base), side_opening(open_side, normal)).x;
    EXPECT_TRUE(albedo >= 0 && albedo <= 1 + 1e-6f) << albedo;
  }
}

FlakeParams horizontal_leaf(const vec3& diffuse, float transmission) {
  FlakeParams p;
  p.sggx = SymMat3::outer({0, 0, 1}), p.diffuse = diffuse, p.transmission = vec3(transmission);
  p.open_side = vec3(0, 0, 0.3f);
  return p;
}

TEST(OpenSide, OfFlakesIsBrighterFromAboveThanFromBelow) {
  const vec3 above = glm::normalize(vec3(0.4f, 0.1f, 0.8f));
  const FlakeParams p = horizontal_leaf(vec3(0.05f), 0);
  const auto albedo_from = [&](const vec3& wo) {
    const FlakePhase phase(p, wo);
    return mean_of(20000, 2, [&](Rng& r) { return phase.sample(r).weight; }).value.x;
  };
  EXPECT_NEAR(albedo_from(above), 0.05 * 1.3 / (0.95 + 0.05 * 1.3), 1e-4);
  EXPECT_NEAR(albedo_from(-above), 0.05 * 0.7 / (0.95 + 0.05 * 0.7), 1e-4);
}

// The highlight knows of its side as the base does, but for what facets reflect onto each other.
TEST(OpenSide, OfGlossyFlakesHasABrighterHighlightFromAbove) {
  const vec3 above = glm::normalize(vec3(0.4f, 0.1f, 0.8f));
  FlakeParams p = horizontal_leaf(vec3(0.0f), 0);
  p.specular = vec3(0.04f), p.roughness2 = 0.1f;
  const auto albedo_from = [&](const vec3& wo, const vec3& open_side) {
    p.open_side = open_side;
    const FlakePhase phase(p, wo);
    return mean_of(20000, 2, [&](Rng& r) { return phase.sample(r).weight; }).value.x;
  };
  const double even = albedo_from(above, vec3(0.0f));
  const auto opened = [&](double opening) { return opening / (1 - even + opening * even); };
  EXPECT_NEAR(albedo_from(above, vec3(0, 0, 0.3f)) / even, opened(1.3), 1e-2);
  EXPECT_NEAR(albedo_from(-above, vec3(0, 0, 0.3f)) / even, opened(0.7), 1e-2);
}

// White furnace; and sample() and eval() are of one model.
TEST(OpenSide, TakesNoLightFromWhiteFlakesAndAddsNone) {
  Rng rng(1);
  for (const NamedSggx& s : sample_sggx()) {
    for (const float through : {0.0f, 0.4f}) {
      for (const float self_shadowing : {1.0f, 0.6f}) {
        FlakeParams p = horizontal_leaf(vec3(1 - through), through);
        p.sggx = s.sggx, p.self_shadowing = self_shadowing;
        const FlakePhase phase(p, vec3(random_direction(rng)));
        const Mean sampled = mean_of(100000, 2, [&](Rng& r) { return phase.sample(r).weight; });
        EXPECT_NEAR(sampled.value.x, 1, 5 * sampled.standard_error.x + 1e-3) << s.name << through;
        const Mean evaluated =
            mean_of(200000, 3, [&](Rng& r) { return 4 * kPi * phase.eval(vec3(random_direction(r)), r); });
        EXPECT_NEAR(evaluated.value.x, 1, 5 * evaluated.standard_error.x + 1e-3) << s.name << through;
      }
    }
  }
}

}  // namespace
}  // namespace farfield
