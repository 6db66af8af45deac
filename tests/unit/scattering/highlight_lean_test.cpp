// SPDX-License-Identifier: Apache-2.0
#include "scattering/highlight_lean.h"

#include <gtest/gtest.h>

#include "scattering/albedo.h"
#include "scattering/flake_phase.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

TEST(HighlightLean, MultipliesWhatDarkFlakesReflectAndLeavesWhiteOnes) {
  const vec3 gain = odds_gain(vec3(0.0f, 0.5f, 1.0f), highlight_leaning(0.4f, -0.5f));
  EXPECT_NEAR(gain.x, 0.8f, 1e-6f);
  EXPECT_TRUE(gain.y > 0.8f && gain.y < 1);
  EXPECT_NEAR(gain.z, 1, 1e-6f);
  EXPECT_EQ(highlight_leaning(0, 1), 1.0f);
}

FlakeParams glossy(const SymMat3& s, const vec3& base, float lean) {
  FlakeParams p;
  p.sggx = s, p.diffuse = base, p.specular = vec3(0.04f), p.roughness2 = 0.2f, p.highlight_lean = lean;
  return p;
}

// Within 5 standard errors of 100000 samples.
TEST(HighlightLean, TakesNoLightFromWhiteFlakesAndAddsNone) {
  Rng rng(1);
  for (const NamedSggx& s : sample_sggx()) {
    for (const float lean : {-kMostHighlightLean, kMostHighlightLean}) {
      const FlakePhase phase(glossy(s.sggx, vec3(1.0f), lean), vec3(random_direction(rng)));
      const Mean albedo = mean_of(100000, 2, [&](Rng& r) { return phase.sample(r).weight; });
      EXPECT_NEAR(albedo.value.x, 1, 5 * albedo.standard_error.x + 5e-3) << s.name << lean;
    }
  }
}

TEST(HighlightLean, OfFlakesSendsTheHighlightToOneSide) {
  const vec3 wo = glm::normalize(vec3(0.3f, -0.5f, 0.8f));
  for (const NamedSggx& s : sample_sggx()) {
    const auto eval = [&](float lean, const vec3& wi) {
      const FlakeParams p = glossy(s.sggx, vec3(0.0f), lean);
      return mean_of(4000, 3, [&](Rng& r) { return FlakePhase(p, wo).eval(wi, r); }).value.x;
    };
    const vec3 front = glm::normalize(wo + vec3(0.1f, 0.1f, 0)), behind = glm::normalize(vec3(0.6f, 0, 0) - wo);
    EXPECT_GE(eval(0.4f, front), 1.2 * eval(0, front)) << s.name;
    EXPECT_LE(eval(0.4f, behind), 0.9 * eval(0, behind)) << s.name;
  }
}

// Of dark flakes, whose albedo does not depend much on where they are seen from.
TEST(HighlightLean, IsReciprocal) {
  Rng rng(7);
  for (const NamedSggx& s : sample_sggx()) {
    const Sggx sggx(s.sggx);
    const FlakeParams p = glossy(s.sggx, vec3(0.0f), 0.4f);
    const vec3 a(random_direction(rng)), b(random_direction(rng));
    const Mean forth = mean_of(40000, 8, [&](Rng& r) { return FlakePhase(p, a).eval(b, r); });
    const Mean back = mean_of(40000, 9, [&](Rng& r) { return FlakePhase(p, b).eval(a, r); });
    const double forth_value = forth.value.x * sggx.sigma(a), back_value = back.value.x * sggx.sigma(b);
    const double error = forth.standard_error.x * sggx.sigma(a) + back.standard_error.x * sggx.sigma(b);
    EXPECT_NEAR(forth_value, back_value, 5 * error + 0.05 * forth_value) << s.name;
  }
}

}  // namespace
}  // namespace farfield
