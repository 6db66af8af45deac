// SPDX-License-Identifier: Apache-2.0
#include "scattering/horizon_lobe.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/random.h"

namespace farfield {
namespace {

constexpr float kAngles[] = {0.0f, 0.05f, 0.4f, 1.0f, 1.5f, 0.5f * kPi};
const vec3 kTopNormal(0, 0, 1);

vec3 shading_normal(float angle) { return {std::sin(angle), 0, std::cos(angle)}; }

SurfaceParams white(float reflected) {
  SurfaceParams params;
  params.diffuse = vec3(reflected), params.transmission = vec3(1 - reflected);
  return params;
}

/// The integral over all directions of a function of them, by even points.
template <class F>
double integral(const F& f) {
  constexpr int kSide = 400;
  double sum = 0;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j)
      sum += f(uniform_sphere((static_cast<float>(i) + 0.5f) / kSide, (static_cast<float>(j) + 0.5f) / kSide));
  }
  return sum * 4 * kPi / (kSide * kSide);
}

TEST(HorizonLobe, GivesBackWhatTheLobeAroundTheShadingNormalLoses) {
  for (const float angle : kAngles) {
    const vec3 m = shading_normal(angle);
    for (const float reflected : {1.0f, 0.7f, 0.0f}) {
      const HorizonLobe lobe(white(reflected), m, kTopNormal);
      const double seen = integral([&](const vec3& wi) {
        const float cosine = glm::dot(m, wi);
        if (cosine * wi.z < 0) return lobe.eval(wi).x;  // on different sides of the two normals
        return lobe.eval(wi).x + (cosine > 0 ? reflected : 1 - reflected) * std::abs(cosine) * kInvPi;
      });
      EXPECT_NEAR(seen, 1, 2e-3) << angle << " " << reflected;
    }
  }
}

TEST(HorizonLobe, SamplesFollowTheDensity) {
  const HorizonLobe lobe(white(0.7f), shading_normal(1), kTopNormal);
  EXPECT_NEAR(integral([&](const vec3& wi) { return lobe.pdf(wi); }), 1, 2e-3);
  Rng rng(3);
  double up = 0, height = 0;
  constexpr int kCount = 200000;
  for (int i = 0; i < kCount; ++i) {
    const float side = rng.next(), u1 = rng.next(), u2 = rng.next();
    const vec3 wi = lobe.sample(side, u1, u2);
    EXPECT_NEAR(lobe.eval(wi).x / lobe.pdf(wi), lobe.chance, 1e-5);
    up += wi.z > 0, height += std::abs(wi.z);
  }
  EXPECT_NEAR(up / kCount, 0.7, 5e-3);
  EXPECT_NEAR(height / kCount, 2.0 / 3, 3e-3);
}

TEST(HorizonLobe, IsNotThereWhereNothingIsLost) {
  SurfaceParams params = white(0.5f);
  EXPECT_EQ(HorizonLobe(params, kTopNormal, kTopNormal).chance, 0);
  params.diffuse = params.transmission = vec3(0.0f);
  EXPECT_EQ(HorizonLobe(params, shading_normal(1), kTopNormal).chance, 0);
  params.diffuse = params.transmission = vec3(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(HorizonLobe(params, shading_normal(1), kTopNormal).chance, 0);
  EXPECT_EQ(HorizonLobe(white(1), vec3(std::numeric_limits<float>::quiet_NaN()), kTopNormal).chance, 0);
}

TEST(HorizonLobe, NeverReturnsMoreThanItGets) {
  SurfaceParams params;
  params.diffuse = vec3(5), params.transmission = vec3(5), params.specular = vec3(0.25f);
  const HorizonLobe lobe(params, shading_normal(0.5f * kPi), kTopNormal);
  EXPECT_NEAR(lobe.reflected.x + lobe.transmitted.x, 0.5f * 0.75f, 1e-5);
}

}  // namespace
}  // namespace farfield
