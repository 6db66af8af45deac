// SPDX-License-Identifier: Apache-2.0
#include "scattering/surface_bsdf.h"

#include <gtest/gtest.h>

#include "scattering/warp.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

/// Albedo towards wo: the mean weight of sample().
Mean sampled_albedo(const SurfaceBsdf& bsdf, int count, uint64_t seed) {
  return mean_of(count, seed, [&](Rng& rng) { return bsdf.sample(rng).weight; });
}

vec3 direction_over(const vec3& n, float cos, float turn) { return Frame(n).to_world(direction_at_height(cos, turn)); }

SurfaceParams plastic(float roughness2) {
  SurfaceParams p;
  p.diffuse = vec3(0.6f, 0.7f, 0.2f);
  p.transmission = vec3(0.4f, 0.3f, 0.5f);
  p.specular = vec3(0.04f);
  p.roughness2 = roughness2;
  return p;
}

TEST(SurfaceBsdf, FlatDiffuseFaceIsExactlyLambertian) {
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) {
    const vec3 n(random_direction(rng));
    SurfaceParams p;
    p.diffuse = vec3(1.0f, 0.5f, 0.0f);
    const SurfaceBsdf bsdf(p, n, direction_over(n, 0.01f + rng.next() * 0.99f, rng.next()));
    const ScatterSample r = bsdf.sample(rng);
    EXPECT_NEAR(r.weight.x, 1, 2e-6);
    EXPECT_NEAR(r.weight.y, 0.5, 1e-6);
    EXPECT_EQ(r.weight.z, 0);
    EXPECT_NEAR(r.pdf, glm::dot(n, r.wi) * kInvPi, 1e-6);
    EXPECT_EQ(bsdf.eval(-r.wi), vec3(0.0f));
  }
}

TEST(SurfaceBsdf, FlatLeafReflectsAndTransmitsAllTheLight) {
  Rng rng(2);
  const vec3 n = glm::normalize(vec3(1, 2, 3));
  SurfaceParams p;
  p.diffuse = vec3(0.7f), p.transmission = vec3(0.3f);
  const SurfaceBsdf bsdf(p, n, direction_over(n, 0.3f, 0.1f));
  int through = 0;
  for (int i = 0; i < 20000; ++i) {
    const ScatterSample r = bsdf.sample(rng);
    ASSERT_NEAR(r.weight.x, 1, 2e-5) << "the chances are those of the albedos, so every weight is 1";
    through += glm::dot(r.wi, n) < 0;
  }
  EXPECT_NEAR(through / 20000.0, 0.3, 0.015);
}

// What absorbs nothing returns all light: 0.5 % by the table's error, and 5 standard errors of 50000 samples.
TEST(SurfaceBsdf, WhiteStaysWhiteFromEveryDirection) {
  const vec3 n = glm::normalize(vec3(-1, 0.2f, 0.4f));
  SurfaceParams metal;
  metal.specular = vec3(1.0f);
  for (const float roughness2 : {0.0f, 1e-3f, 0.02f, 0.1f, 0.25f, 0.6f, 1.0f}) {
    for (const float cos : {1.0f, 0.7f, 0.3f, 0.1f, 0.03f, 0.01f}) {
      const vec3 wo = direction_over(n, cos, 0.6f);
      metal.roughness2 = roughness2;
      for (const SurfaceParams& white : {plastic(roughness2), metal}) {
        const Mean albedo = sampled_albedo(SurfaceBsdf(white, n, wo), 50000, 3);
        EXPECT_NEAR(albedo.value.x, 1, 0.005 + 5 * albedo.standard_error.x)
            << white.specular.x << ' ' << roughness2 << ' ' << cos;
      }
    }
  }
}

TEST(SurfaceBsdf, NeverReflectsMoreThanItReceives) {
  Rng rng(4);
  for (int i = 0; i < 300; ++i) {
    const vec3 n(random_direction(rng));
    SurfaceParams p = plastic(rng.next());
    if (i % 3 == 1) p.specular = vec3(1.0f, 0.5f, 0.0f);
    if (i % 3 == 2) p.specular = vec3(0.0f);
    const float cos = 0.02f + 0.98f * rng.next();
    const SurfaceBsdf bsdf(p, n, direction_over(n, cos, rng.next()));
    const Mean albedo = sampled_albedo(bsdf, 4000, 5 + i);
    for (int c = 0; c < 3; ++c) {
      EXPECT_LT(albedo.value[c], 1.005 + 5 * albedo.standard_error[c]) << "cos=" << cos << " r2=" << p.roughness2;
    }
  }
}

TEST(SurfaceBsdf, IsReciprocal) {
  Rng rng(6);
  for (int i = 0; i < 200; ++i) {
    const vec3 n(random_direction(rng));
    const SurfaceParams p = plastic(rng.next());
    const bool through = i % 2 == 0;
    const vec3 a = direction_over(n, 0.01f + 0.99f * rng.next(), rng.next());
    const vec3 b = direction_over(n, (through ? -1.0f : 1.0f) * (0.01f + 0.99f * rng.next()), rng.next());
    const vec3 forth = SurfaceBsdf(p, n, a).eval(b) * std::abs(glm::dot(a, n));
    const vec3 back = SurfaceBsdf(p, through ? -n : n, b).eval(a) * std::abs(glm::dot(b, n));
    EXPECT_GT(forth.x, 0);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(forth[c], back[c], 1e-4f * (1 + forth[c])) << "through=" << through;
  }
}

TEST(SurfaceBsdf, PdfIsTheDensityOfSample) {
  Rng rng(9);
  for (const float roughness2 : {0.05f, 0.2f, 0.5f, 1.0f}) {
    const vec3 n(random_direction(rng));
    const SurfaceBsdf bsdf(plastic(roughness2), n, direction_over(n, 0.5f, rng.next()));
    ChiSquareOptions options;
    options.axis = dvec3(n);
    const double p = chi_square_p_value([&](Rng& r) { return dvec3(bsdf.sample(r).wi); },
                                        [&](const dvec3& w) { return double(bsdf.pdf(vec3(w))); }, options);
    EXPECT_GT(p, kSignificance) << roughness2;
  }
}

TEST(SurfaceBsdf, WeightIsEvalOverPdf) {
  Rng rng(10);
  for (const float roughness2 : {0.1f, 0.3f, 1.0f}) {
    const vec3 n(random_direction(rng));
    const SurfaceBsdf bsdf(plastic(roughness2), n, direction_over(n, 0.8f, 0.2f));
    // Two routes to the albedo: sampling, and uniform directions with eval. 5 standard errors each.
    const Mean sampled = sampled_albedo(bsdf, 100000, 11);
    dvec3 sum(0.0), sum2(0.0);
    const int count = 100000;
    for (int i = 0; i < count; ++i) {
      const dvec3 f(bsdf.eval(vec3(random_direction(rng))) * (4 * kPi));
      sum += f, sum2 += f * f;
    }
    const dvec3 mean = sum / double(count);
    for (int c = 0; c < 3; ++c) {
      const double error = std::sqrt((sum2[c] / count - mean[c] * mean[c]) / count);
      EXPECT_NEAR(mean[c], sampled.value[c], 5 * (error + sampled.standard_error[c])) << roughness2;
    }
  }
}

TEST(SurfaceBsdf, ExtremesAreFiniteAndNotNegative) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const vec3 n(0, 0, 1);
  Rng rng(12);
  const vec3 directions[] = {{0, 0, 1},
                             {1, 0, 0},
                             {0, -1, 0},
                             glm::normalize(vec3(1, 0, 1e-6f)),
                             glm::normalize(vec3(1, 1, 1e-3f)),
                             glm::normalize(vec3(0.2f, -0.3f, 0.7f))};
  for (const float albedo : {0.0f, 1.0f, nan, 2.0f, -1.0f}) {
    for (const float specular : {0.0f, 1e-6f, 0.04f, 1.0f, nan, 2.0f, -1.0f}) {
      for (const float roughness2 : {-1.0f, 0.0f, 1e-8f, 1.0f, 1e30f, nan}) {
        SurfaceParams p;
        p.diffuse = vec3(albedo), p.specular = vec3(specular), p.transmission = vec3(albedo);
        p.roughness2 = roughness2;
        for (const vec3& wo : directions) {
          const SurfaceBsdf bsdf(p, n, wo);
          const ScatterSample r = bsdf.sample(rng);
          ASSERT_TRUE(is_finite(r.weight) && min_component(r.weight) >= 0 && std::isfinite(r.pdf))
              << albedo << roughness2;
          for (const vec3& d : directions) {
            for (const vec3& wi : {d, -d, wo, -wo}) {
              const vec3 f = bsdf.eval(wi);
              ASSERT_TRUE(is_finite(f) && min_component(f) >= 0) << f.x << ' ' << albedo << ' ' << roughness2;
              ASSERT_TRUE(std::isfinite(bsdf.pdf(wi)) && bsdf.pdf(wi) >= 0) << bsdf.pdf(wi);
            }
          }
        }
      }
    }
  }
}

TEST(SurfaceBsdf, IsBlackFromBehindAndAtGrazing) {
  Rng rng(13);
  const vec3 n(0, 0, 1);
  for (const vec3& wo : {vec3(1, 0, 0), vec3(0, 0, -1)}) {
    const SurfaceBsdf bsdf(plastic(0.5f), n, wo);
    EXPECT_EQ(bsdf.eval(vec3(0, 0, 1)), vec3(0.0f));
    EXPECT_EQ(bsdf.sample(rng).weight, vec3(0.0f));
    EXPECT_EQ(bsdf.pdf(vec3(0, 0, 1)), 0);
  }
}

}  // namespace
}  // namespace farfield
