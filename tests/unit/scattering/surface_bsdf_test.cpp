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

/// E[eval] over rng for one pair of directions.
Mean mean_eval(const SurfaceBsdf& bsdf, const vec3& wi, int count, uint64_t seed) {
  return mean_of(count, seed, [&](Rng& rng) { return bsdf.eval(wi, rng); });
}

vec3 direction_over(const vec3& n, float cos, float turn) { return Frame(n).to_world(direction_at_height(cos, turn)); }

SurfaceParams plastic(const SymMat3& s, float roughness2) {
  SurfaceParams p;
  p.sggx = s;
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
    p.sggx = SymMat3::outer(n) * 0.37f;
    p.diffuse = vec3(1.0f, 0.5f, 0.0f);
    const SurfaceBsdf bsdf(p, n, direction_over(n, 0.01f + rng.next() * 0.99f, rng.next()));
    const ScatterSample r = bsdf.sample(rng);
    EXPECT_NEAR(r.weight.x, 1, 2e-6);
    EXPECT_NEAR(r.weight.y, 0.5, 1e-6);
    EXPECT_EQ(r.weight.z, 0);
    EXPECT_NEAR(r.pdf, glm::dot(n, r.wi) * kInvPi, 1e-6);
    EXPECT_EQ(bsdf.eval(-r.wi, rng), vec3(0.0f));
  }
}

TEST(SurfaceBsdf, FlatLeafReflectsAndTransmitsAllTheLight) {
  Rng rng(2);
  const vec3 n = glm::normalize(vec3(1, 2, 3));
  SurfaceParams p;
  p.sggx = SymMat3::outer(n);
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

// 5 standard errors of 50000 samples. A flat plastic that absorbs nothing may lose what its specular lobe loses to
// missing multiple scattering, and must never gain.
TEST(SurfaceBsdf, FlatPlasticConservesEnergyInEveryDirection) {
  const vec3 n = glm::normalize(vec3(-1, 0.2f, 0.4f));
  for (const float roughness2 : {0.0f, 1e-3f, 0.02f, 0.25f, 1.0f}) {
    for (const float cos : {1.0f, 0.7f, 0.3f, 0.1f, 0.01f}) {
      const SurfaceBsdf bsdf(plastic(SymMat3::outer(n), roughness2), n, direction_over(n, cos, 0.6f));
      const Mean albedo = sampled_albedo(bsdf, 50000, 3);
      EXPECT_LT(albedo.value.x, 1.004 + 5 * albedo.standard_error.x) << roughness2 << ' ' << cos;
      EXPECT_GT(albedo.value.x, (cos < 0.2f ? 0.88 : 0.92) - 5 * albedo.standard_error.x) << roughness2 << ' ' << cos;
    }
  }
}

TEST(SurfaceBsdf, NeverReflectsMoreThanItReceives) {
  Rng rng(4);
  for (const NamedSggx& s : sample_sggx()) {
    for (int i = 0; i < 30; ++i) {
      const vec3 n(random_direction(rng));
      SurfaceParams p = plastic(s.sggx, rng.next());
      if (i % 3 == 1) p.specular = vec3(1.0f, 0.5f, 0.0f);
      if (i % 3 == 2) p.specular = vec3(0.0f);
      const float cos = 0.02f + 0.98f * rng.next();
      const SurfaceBsdf bsdf(p, n, direction_over(n, cos, rng.next()));
      const Mean albedo = sampled_albedo(bsdf, 4000, 5 + i);
      for (int c = 0; c < 3; ++c) {
        EXPECT_LT(albedo.value[c], 1.004 + 5 * albedo.standard_error[c])
            << s.name << " n=" << n.x << ',' << n.y << ',' << n.z << " cos=" << cos << " r2=" << p.roughness2;
      }
    }
  }
}

// f cos_i cos_o is symmetric: both ways agree within 5 standard errors of 40000 evaluations.
TEST(SurfaceBsdf, IsReciprocal) {
  Rng rng(6);
  for (const NamedSggx& s : sample_sggx()) {
    for (int i = 0; i < 6; ++i) {
      const vec3 n(random_direction(rng));
      const SurfaceParams p = plastic(s.sggx, 0.05f + rng.next());
      const vec3 a = direction_over(n, 0.05f + 0.95f * rng.next(), rng.next());
      const vec3 b = direction_over(n, (i % 2 ? 1.0f : -1.0f) * (0.05f + 0.95f * rng.next()), rng.next());
      const bool through = i % 2 == 0;
      const Mean forth = mean_eval(SurfaceBsdf(p, n, a), b, 40000, 7);
      const Mean back = mean_eval(SurfaceBsdf(p, through ? -n : n, b), a, 40000, 8);
      const double cos_a = std::abs(glm::dot(a, n)), cos_b = std::abs(glm::dot(b, n));
      for (int c = 0; c < 3; ++c) {
        const double error = forth.standard_error[c] * cos_a + back.standard_error[c] * cos_b;
        EXPECT_NEAR(forth.value[c] * cos_a, back.value[c] * cos_b, 5 * error + 1e-5 * (1 + forth.value[c]))
            << s.name << " through=" << through;
      }
    }
  }
}

TEST(SurfaceBsdf, PdfIsTheDensityOfSample) {
  Rng rng(9);
  for (const NamedSggx& s : sample_sggx()) {
    const vec3 n(random_direction(rng));
    const SurfaceBsdf bsdf(plastic(s.sggx, 0.2f + 0.5f * rng.next()), n, direction_over(n, 0.5f, rng.next()));
    ChiSquareOptions options;
    options.axis = dvec3(n);
    const double p = chi_square_p_value([&](Rng& r) { return dvec3(bsdf.sample(r).wi); },
                                        [&](const dvec3& w) { return double(bsdf.pdf(vec3(w))); }, options);
    EXPECT_GT(p, kSignificance) << s.name;
  }
}

TEST(SurfaceBsdf, WeightIsEvalOverPdf) {
  Rng rng(10);
  for (const NamedSggx& s : sample_sggx()) {
    const vec3 n(random_direction(rng));
    const SurfaceBsdf bsdf(plastic(s.sggx, 0.3f), n, direction_over(n, 0.8f, 0.2f));
    // Two routes to the albedo: sampling, and uniform directions with eval. 5 standard errors each.
    const Mean sampled = sampled_albedo(bsdf, 100000, 11);
    dvec3 sum(0.0), sum2(0.0);
    const int count = 100000;
    for (int i = 0; i < count; ++i) {
      const dvec3 f(bsdf.eval(vec3(random_direction(rng)), rng) * (4 * kPi));
      sum += f, sum2 += f * f;
    }
    const dvec3 mean = sum / double(count);
    for (int c = 0; c < 3; ++c) {
      const double error = std::sqrt((sum2[c] / count - mean[c] * mean[c]) / count);
      EXPECT_NEAR(mean[c], sampled.value[c], 5 * (error + sampled.standard_error[c])) << s.name;
    }
  }
}

TEST(SurfaceBsdf, ExtremesAreFiniteAndNotNegative) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float huge = 1e30f;
  std::vector<SymMat3> matrices = {SymMat3{},
                                   SymMat3::identity() * nan,
                                   SymMat3::identity() * huge,
                                   SymMat3::identity() * 1e-38f,
                                   SymMat3{1, 1, 1, 1, 1, -1},
                                   SymMat3{-1, -1, -1, 0, 0, 0},
                                   SymMat3::outer({1, 0, 0}),
                                   SymMat3{1, 1e-8f, 1e-8f, 0, 0, 0}};
  for (const NamedSggx& s : sample_sggx()) matrices.push_back(s.sggx);
  const vec3 n(0, 0, 1);
  Rng rng(12);
  const vec3 directions[] = {{0, 0, 1},
                             {1, 0, 0},
                             {0, -1, 0},
                             glm::normalize(vec3(1, 0, 1e-6f)),
                             glm::normalize(vec3(1, 1, 1e-3f)),
                             glm::normalize(vec3(0.2f, -0.3f, 0.7f))};
  for (const SymMat3& s : matrices) {
    for (const float albedo : {0.0f, 1.0f, nan, 2.0f, -1.0f}) {
      for (const float roughness2 : {0.0f, 1e-8f, 1.0f, nan}) {
        SurfaceParams p;
        p.sggx = s, p.diffuse = vec3(albedo), p.specular = vec3(albedo), p.transmission = vec3(albedo);
        p.roughness2 = roughness2;
        for (const vec3& wo : directions) {
          const SurfaceBsdf bsdf(p, n, wo);
          const ScatterSample r = bsdf.sample(rng);
          ASSERT_TRUE(is_finite(r.weight) && min_component(r.weight) >= 0 && std::isfinite(r.pdf))
              << albedo << roughness2;
          for (const vec3& d : directions) {
            for (const vec3& wi : {d, -d, wo, -wo}) {
              const vec3 f = bsdf.eval(wi, rng);
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
    const SurfaceBsdf bsdf(plastic(SymMat3::identity(), 0.5f), n, wo);
    EXPECT_EQ(bsdf.eval(vec3(0, 0, 1), rng), vec3(0.0f));
    EXPECT_EQ(bsdf.sample(rng).weight, vec3(0.0f));
    EXPECT_EQ(bsdf.pdf(vec3(0, 0, 1)), 0);
  }
}

}  // namespace
}  // namespace farfield
