// SPDX-License-Identifier: Apache-2.0
#include "scattering/flake_phase.h"

#include <gtest/gtest.h>

#include "scattering/albedo.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

FlakeParams leaf(const SymMat3& s) {
  FlakeParams p;
  p.sggx = s;
  p.diffuse = vec3(0.7f, 0.2f, 0.5f);
  p.transmission = vec3(0.3f, 0.6f, 0.5f);
  return p;
}

FlakeParams glossy_leaf(const SymMat3& s, float roughness2, float self_shadowing) {
  FlakeParams p = leaf(s);
  p.specular = vec3(0.04f, 0.04f, 0.5f);
  p.roughness2 = roughness2;
  p.self_shadowing = self_shadowing;
  return p;
}

TEST(FlakePhase, WhiteDiffuseFlakesLoseNothing) {
  Rng rng(1);
  for (const NamedSggx& s : sample_sggx()) {
    for (const float shadowing : {1.0f, 0.6f, 1e-3f}) {
      FlakeParams p;
      p.sggx = s.sggx, p.diffuse = vec3(1.0f), p.self_shadowing = shadowing;
      const FlakePhase phase(p, vec3(random_direction(rng)));
      for (int i = 0; i < 200; ++i) EXPECT_NEAR(phase.sample(rng).weight.x, 1, 1e-5) << s.name << shadowing;
    }
  }
}

// A flake that shadows itself is a cluster. 5 standard errors of 20000 samples.
TEST(FlakePhase, LeavesHaveTheAlbedoOfTheirCluster) {
  Rng rng(2);
  for (const NamedSggx& s : sample_sggx()) {
    for (const float shadowing : {1.0f, 0.5f}) {
      FlakeParams p = leaf(s.sggx);
      p.self_shadowing = shadowing;
      const FlakePhase phase(p, vec3(random_direction(rng)));
      const Mean albedo = mean_of(20000, 3, [&](Rng& r) { return phase.sample(r).weight; });
      EXPECT_NEAR(albedo.value.x, 1, 5 * albedo.standard_error.x + 1e-5) << s.name;
      EXPECT_NEAR(albedo.value.y, cluster_albedo(vec3(0.8f), shadowing).y, 5 * albedo.standard_error.y + 1e-5)
          << s.name;
    }
  }
}

// All but what the smallest roughness of a surface (alpha = 0.001) masks where a flake is seen edge on.
TEST(FlakePhase, MirrorFlakesLoseNothing) {
  Rng rng(4);
  for (const NamedSggx& s : sample_sggx()) {
    FlakeParams p;
    p.sggx = s.sggx, p.specular = vec3(1.0f), p.roughness2 = 0;
    const FlakePhase phase(p, vec3(random_direction(rng)));
    for (int i = 0; i < 200; ++i) EXPECT_NEAR(phase.sample(rng).weight.x, 1, 2e-2) << s.name;
  }
}

TEST(FlakePhase, NeverScattersMoreThanItReceives) {
  Rng rng(5);
  for (const NamedSggx& s : sample_sggx()) {
    for (const float roughness2 : {0.0f, 0.01f, 0.2f, 1.0f}) {
      for (int i = 0; i < 6; ++i) {
        const FlakePhase phase(glossy_leaf(s.sggx, roughness2, i % 2 ? 1.0f : 0.5f), vec3(random_direction(rng)));
        const Mean albedo = mean_of(10000, 6, [&](Rng& r) { return phase.sample(r).weight; });
        for (int c = 0; c < 3; ++c) {
          EXPECT_LT(albedo.value[c], 1.004 + 5 * albedo.standard_error[c]) << s.name << ' ' << roughness2;
        }
      }
    }
  }
}

// sigma(wo) f(wo, wi) is symmetric, within 5 standard errors of 40000 evaluations.
TEST(FlakePhase, IsReciprocal) {
  Rng rng(7);
  for (const NamedSggx& s : sample_sggx()) {
    const Sggx sggx(s.sggx);
    for (int i = 0; i < 4; ++i) {
      const FlakeParams p = glossy_leaf(s.sggx, 0.05f + rng.next(), 0.7f);
      const vec3 a(random_direction(rng)), b(random_direction(rng));
      const Mean forth = mean_of(40000, 8, [&](Rng& r) { return FlakePhase(p, a).eval(b, r); });
      const Mean back = mean_of(40000, 9, [&](Rng& r) { return FlakePhase(p, b).eval(a, r); });
      const double scale = std::max(sggx.sigma(a), sggx.sigma(b));
      const double sa = sggx.sigma(a) / scale, sb = sggx.sigma(b) / scale;
      for (int c = 0; c < 3; ++c) {
        const double error = forth.standard_error[c] * sa + back.standard_error[c] * sb;
        EXPECT_NEAR(forth.value[c] * sa, back.value[c] * sb, 5 * error + 1e-4 * (1e-3 + forth.value[c] * sa)) << s.name;
      }
    }
  }
}

// The phase function itself, by its own definition in double with fixed quadrature over the visible normals.
double diffuse_reference(const BasicSggx<double>& sggx, const dvec3& wo, const dvec3& wi) {
  constexpr int n = 24;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < 2 * n; ++j) {
      sum += std::max(0.0, glm::dot(wi, sggx.sample_visible(wo, (i + 0.5) / n, (j + 0.5) / (2 * n))));
    }
  }
  return sum / (2 * n * n) / kPiOf<double>;
}

TEST(FlakePhase, SamplesFollowTheDiffusePhaseFunction) {
  Rng rng(10);
  for (const NamedSggx& s : sample_sggx()) {
    FlakeParams p = leaf(s.sggx);
    p.diffuse = vec3(0.75f), p.transmission = vec3(0.25f);
    const dvec3 wo = random_direction(rng);
    const FlakePhase phase(p, vec3(wo));
    const BasicSggx<double> sggx(s.sggx);
    ChiSquareOptions options;
    options.bins = 8, options.nodes_per_bin = 4, options.samples = 100000;
    options.axis = glm::normalize(dvec3(s.sggx.to_mat3() * vec3(wo)));
    const double p_value =
        chi_square_p_value([&](Rng& r) { return dvec3(phase.sample(r).wi); },
                           [&](const dvec3& wi) {
                             return 0.75 * diffuse_reference(sggx, wo, wi) + 0.25 * diffuse_reference(sggx, wo, -wi);
                           },
                           options);
    EXPECT_GT(p_value, kSignificance) << s.name;
  }
}

TEST(FlakePhase, SamplesFollowPdfWherePdfIsExact) {
  Rng rng(11);
  for (const NamedSggx& s : sample_sggx()) {
    FlakeParams p;
    p.sggx = specular_sggx(s.sggx, 0.3f), p.specular = vec3(0.8f), p.roughness2 = 0, p.self_shadowing = 0.4f;
    const FlakePhase phase(p, vec3(random_direction(rng)));
    const double p_value = chi_square_p_value([&](Rng& r) { return dvec3(phase.sample(r).wi); },
                                              [&](const dvec3& w) { return double(phase.pdf(vec3(w))); });
    EXPECT_GT(p_value, kSignificance) << s.name;
  }
  FlakeParams isotropic = leaf(SymMat3::identity());
  const FlakePhase phase(isotropic, vec3(random_direction(rng)));
  EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(phase.sample(r).wi); },
                               [&](const dvec3& w) { return double(phase.pdf(vec3(w))); }),
            kSignificance);
}

// What voxelisation relies on: flakes in all orientations reflect as much light, and as much of it back and forth, as
// flat faces in all orientations. 200000 samples each, within 5 standard errors.
TEST(FlakePhase, FlakesScatterLikeTheFacesTheyStandFor) {
  const vec3 wo(0, 0, 1);
  for (const float roughness2 : {0.0f, 0.06f, 0.3f, 1.0f}) {
    const FlakeParams p = glossy_leaf(SymMat3::identity(), roughness2, 1.0f);
    const FlakePhase phase(p, wo);
    const auto by_side = [](const ScatterSample& r) {
      return r.weight.y * vec3(1.0f, r.wi.z > 0.5f ? 1.0f : 0.0f, r.wi.z < -0.5f ? 1.0f : 0.0f);
    };
    const Mean flakes = mean_of(200000, 16, [&](Rng& r) { return by_side(phase.sample(r)); });
    // Faces are seen in proportion to their cosine, whose mean over orientations is 1/2.
    const Mean faces = mean_of(200000, 17, [&](Rng& r) {
      vec3 n(random_direction(r));
      if (n.z < 0) n = -n;
      const SurfaceParams face{p.diffuse, p.specular, p.transmission, roughness2};
      return 2.0f * n.z * by_side(SurfaceBsdf(face, n, wo).sample(r));
    });
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(flakes.value[c], faces.value[c], 5 * (flakes.standard_error[c] + faces.standard_error[c]))
          << roughness2 << ' ' << c;
    }
  }
}

TEST(FlakePhase, PdfIsNormalised) {
  Rng rng(12);
  for (const NamedSggx& s : sample_sggx()) {
    const dvec3 wo = random_direction(rng);
    const FlakePhase phase(glossy_leaf(s.sggx, 0.3f, 0.5f), vec3(wo));
    const dvec3 axis = glm::normalize(dvec3(s.sggx.to_mat3() * vec3(wo)));
    EXPECT_NEAR(integrate_sphere([&](const dvec3& w) { return double(phase.pdf(vec3(w))); }, 64, axis), 1, 2e-3)
        << s.name;
  }
}

TEST(FlakePhase, EvalAgreesWithSample) {
  Rng rng(13);
  for (const NamedSggx& s : sample_sggx()) {
    const FlakePhase phase(glossy_leaf(s.sggx, 0.4f, 0.6f), vec3(random_direction(rng)));
    const Mean sampled = mean_of(100000, 14, [&](Rng& r) { return phase.sample(r).weight; });
    const Mean evaluated =
        mean_of(100000, 15, [&](Rng& r) { return phase.eval(vec3(random_direction(r)), r) * (4 * kPi); });
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(sampled.value[c], evaluated.value[c],
                  5 * (sampled.standard_error[c] + evaluated.standard_error[c]) + 1e-6)
          << s.name;
    }
  }
}

TEST(FlakePhase, ExtremesAreFiniteAndNotNegative) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<SymMat3> matrices = {SymMat3{},
                                   SymMat3::identity() * nan,
                                   SymMat3::identity() * 1e30f,
                                   SymMat3::identity() * 1e-38f,
                                   SymMat3{1, 1, 1, 1, 1, -1},
                                   SymMat3{-1, -1, -1, 0, 0, 0},
                                   SymMat3::outer({1, 0, 0}),
                                   SymMat3{1, 1e-8f, 1e-8f, 0, 0, 0}};
  for (const NamedSggx& s : sample_sggx()) matrices.push_back(s.sggx);
  Rng rng(16);
  const vec3 directions[] = {
      {0, 0, 1}, {1, 0, 0}, {0, -1, 0}, glm::normalize(vec3(1, 0, 1e-6f)), glm::normalize(vec3(0.2f, -0.3f, 0.7f))};
  for (const SymMat3& s : matrices) {
    for (const float albedo : {0.0f, 1.0f, nan, 2.0f, -1.0f}) {
      for (const float roughness2 : {0.0f, 1.0f, nan}) {
        for (const float shadowing : {1.0f, 1e-3f, 0.0f, nan}) {
          FlakeParams p;
          p.sggx = s, p.diffuse = p.specular = p.transmission = vec3(albedo);
          p.roughness2 = roughness2, p.self_shadowing = shadowing;
          for (const vec3& wo : directions) {
            const FlakePhase phase(p, wo);
            const ScatterSample r = phase.sample(rng);
            ASSERT_TRUE(is_finite(r.weight) && min_component(r.weight) >= 0 && std::isfinite(r.pdf));
            for (const vec3& d : directions) {
              for (const vec3& wi : {d, -d, wo, -wo}) {
                const vec3 f = phase.eval(wi, rng);
                ASSERT_TRUE(is_finite(f) && min_component(f) >= 0) << f.x << ' ' << albedo << ' ' << roughness2;
                ASSERT_TRUE(std::isfinite(phase.pdf(wi)) && phase.pdf(wi) >= 0);
              }
            }
          }
        }
      }
    }
  }
}

TEST(FlakePhase, BlackFlakesScatterNothing) {
  Rng rng(17);
  FlakeParams p;
  p.sggx = SymMat3::identity(), p.self_shadowing = 0.5f;
  const FlakePhase phase(p, vec3(0, 0, 1));
  EXPECT_EQ(phase.eval(vec3(0, 1, 0), rng), vec3(0.0f));
  EXPECT_EQ(phase.sample(rng).weight, vec3(0.0f));
}

}  // namespace
}  // namespace farfield
