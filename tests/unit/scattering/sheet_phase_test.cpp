// SPDX-License-Identifier: Apache-2.0
#include "scattering/sheet_phase.h"

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

const vec3 kSheetNormal(0, 0, 1);

FlakeParams planks(float albedo) {
  FlakeParams p;
  p.sggx = {0.49f, 0, 1, 0, 0, 0};  // sides 0.7 of their fronts
  p.diffuse = vec3(albedo);
  return p;
}

/// Of all kinds: square, round, in between; few and many; with and without light that is caught.
std::vector<SheetShape> shapes() {
  std::vector<SheetShape> all;
  for (const float edge : {0.0f, 0.4f, 1.0f}) {
    for (const float order : {0.1f, 1.0f}) {
      for (const float caught : {0.0f, 0.5f}) all.push_back({edge, order, caught});
    }
  }
  return all;
}

TEST(SheetPhase, WhitePiecesLoseNothing) {
  Rng rng(1);
  for (const SheetShape& shape : shapes()) {
    for (const float gap : {0.0f, 0.3f, 0.9f}) {
      const SheetPhase phase(planks(1), shape, gap, kSheetNormal, vec3(random_direction(rng)));
      for (int i = 0; i < 50; ++i) EXPECT_NEAR(phase.sample(rng).weight.x, 1, 1e-4);
    }
  }
}

TEST(SheetPhase, NeverScattersMoreThanItReceives) {
  Rng rng(2);
  for (const SheetShape& shape : shapes()) {
    FlakeParams p = planks(0.6f);
    p.specular = vec3(0.3f), p.roughness2 = 0.1f;
    const SheetPhase phase(p, shape, 0.5f, kSheetNormal, vec3(random_direction(rng)));
    const Mean albedo = mean_of(4000, 3, [&](Rng& r) { return phase.sample(r).weight; });
    EXPECT_LT(albedo.value.x, 1.004 + 5 * albedo.standard_error.x);
  }
}

/// Samples against uniform directions: 5 standard errors of 40000 each.
TEST(SheetPhase, SamplesWhatItEvaluates) {
  Rng rng(4);
  const vec3 towards = glm::normalize(vec3(0.4f, -0.2f, 0.6f));
  const auto weighed = [&](const vec3& value, const vec3& wi) {
    return value * (1.0f + glm::dot(wi, towards));  // so that directions matter
  };
  for (const SheetShape& shape : shapes()) {
    const SheetPhase phase(planks(0.6f), shape, 0.5f, kSheetNormal, vec3(random_direction(rng)));
    const Mean sampled = mean_of(40000, 5, [&](Rng& r) {
      const ScatterSample sample = phase.sample(r);
      return weighed(sample.weight, sample.wi);
    });
    const Mean uniform = mean_of(40000, 6, [&](Rng& r) {
      const vec3 wi(random_direction(r));
      return weighed(phase.eval(wi, r) * (4 * kPi), wi);
    });
    const double error = std::hypot(sampled.standard_error.x, uniform.standard_error.x);
    EXPECT_NEAR(sampled.value.x, uniform.value.x, 5 * error + 1e-4) << shape.edge << ' ' << shape.order;
  }
}

TEST(SheetPhase, HasADensityOfOne) {
  Rng rng(7);
  for (const SheetShape& shape : shapes()) {
    const SheetPhase phase(planks(0.6f), shape, 0.5f, kSheetNormal, vec3(random_direction(rng)));
    const Mean sum = mean_of(40000, 8, [&](Rng& r) { return vec3(phase.pdf(vec3(random_direction(r))) * 4 * kPi); });
    EXPECT_NEAR(sum.value.x, 1, 5 * sum.standard_error.x + 0.01);
  }
}

TEST(SheetPhase, OfASquareWithoutDepthIsLambertsLaw) {
  FlakeParams p = planks(0.5f);
  p.sggx = SymMat3::outer(kSheetNormal);
  Rng rng(9);
  const SheetPhase phase(p, {1, 1, 0}, 0.5f, kSheetNormal, glm::normalize(vec3(0.3f, 0.1f, 0.8f)));
  for (int i = 0; i < 100; ++i) {
    const vec3 wi(random_direction(rng));
    EXPECT_NEAR(phase.eval(wi, rng).x, 0.5f * std::max(wi.z, 0.0f) * kInvPi, 1e-4f);
  }
}

/// Seen and lit across, where the same part of the sides is seen and lit; then lit from where another part is.
TEST(SheetPhase, LightDoesNotReachWhereItsWayIsBlocked) {
  Rng rng(10);
  FlakeParams black_behind = planks(0.01f);  // so that next to nothing comes back from other pieces
  const vec3 flat = glm::normalize(vec3(1, 0, 0.2f));
  const SheetPhase phase(black_behind, {1, 1, 0.5f}, 0.3f, kSheetNormal, flat);
  const auto light = [&](const vec3& wi) {
    return mean_of(2000, 11, [&](Rng& r) { return phase.eval(wi, r); }).value.x;
  };
  const float lit = 0.01f * kInvPi * (0.7f * flat.z + 0.3f * flat.x);  // fronts hide all of the sides but a gap's width
  EXPECT_NEAR(light(flat), lit, 0.05f * lit);
  EXPECT_LT(light({flat.x, flat.y, -flat.z}), 0.02f * light(flat));  // the sides' upper ends are seen, lower ones lit
}

}  // namespace
}  // namespace farfield
