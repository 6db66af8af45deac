// SPDX-License-Identifier: Apache-2.0
#include "scattering/fog_phase.h"

#include <gtest/gtest.h>

#include "scattering/albedo.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

/// Fog of every kind that levels have.
std::vector<FogParams> kinds_of_fog() {
  std::vector<FogParams> all;
  for (const float g : {0.0f, 0.85f, -0.6f, 1e-5f})
    for (const float share : {1.0f, 0.3f})
      for (const bool has_shape : {false, true}) {
        FogParams fog;
        fog.albedo = vec3(0.9f, 0.5f, 1.0f);
        fog.anisotropy = g, fog.self_shadowing = share, fog.has_shape = has_shape;
        fog.sggx = {1, 0.2f, 0.4f, 0.1f, 0, -0.2f};
        all.push_back(fog);
      }
  return all;
}

std::string name(const FogParams& fog) {
  return "g " + std::to_string(fog.anisotropy) + " A " + std::to_string(fog.self_shadowing) +
         (fog.has_shape ? " shaped" : "");
}

TEST(FogPhase, SendsOutWhatItsAlbedoSays) {
  Rng rng(1);
  for (const FogParams& fog : kinds_of_fog()) {
    const FogPhase phase(fog, vec3(0.6f, 0, 0.8f));
    const vec3 albedo = cluster_albedo(fog.albedo, fog.self_shadowing);
    for (int c = 0; c < 3; ++c) {
      const double out = integrate_sphere_graded([&](const dvec3& wi) { return double(phase.eval(vec3(wi), rng)[c]); },
                                                 64, {0.6, 0, 0.8});
      EXPECT_NEAR(out, double(albedo[c]), 2e-4) << name(fog);
    }
    EXPECT_NEAR(
        integrate_sphere_graded([&](const dvec3& wi) { return double(phase.pdf(vec3(wi))); }, 64, {0.6, 0, 0.8}), 1,
        2e-4)
        << name(fog);
  }
}

TEST(FogPhase, SamplesHaveTheirDensityAndWeights) {
  for (const FogParams& fog : kinds_of_fog()) {
    const FogPhase phase(fog, vec3(0, -1, 0));
    ChiSquareOptions options;
    options.axis = {0, 1, 0};
    EXPECT_GT(chi_square_p_value([&](Rng& r) { return dvec3(phase.sample(r).wi); },
                                 [&](const dvec3& wi) { return double(phase.pdf(vec3(wi))); }, options),
              kSignificance)
        << name(fog);
    Rng rng(2);
    for (int i = 0; i < 100; ++i) {
      const ScatterSample sample = phase.sample(rng);
      EXPECT_FLOAT_EQ(sample.pdf, phase.pdf(sample.wi));
      const vec3 value = phase.eval(sample.wi, rng);
      EXPECT_NEAR(sample.weight.x * sample.pdf, value.x, 1e-5f * value.x) << name(fog);
      EXPECT_LE(max_component(sample.weight), 1.0f + 1e-6f);
    }
  }
}

TEST(FogPhase, TheMeanCosineIsG) {
  for (const float g : {0.98f, 0.5f, 0.0f, -0.9f}) {
    FogParams fog;
    fog.anisotropy = g;
    const vec3 wo(0, 0, 1);
    const Mean mean = mean_of(200000, 3, [&](Rng& r) { return vec3(-FogPhase(fog, wo).sample(r).wi.z); });
    EXPECT_NEAR(mean.value.x, double(g), 5 * mean.standard_error.x + 1e-4);
  }
}

TEST(FogPhase, IsIsotropicWithoutAnisotropyAndShape) {
  Rng rng(4);
  const FogPhase phase({}, vec3(1, 0, 0));
  EXPECT_FLOAT_EQ(phase.eval(vec3(0, 0, 1), rng).x, 0.25f * kInvPi);
  EXPECT_FLOAT_EQ(phase.pdf(vec3(-1, 0, 0)), 0.25f * kInvPi);
}

// sigma(wo) f(wo, wi) = sigma(wi) f(wi, wo)
TEST(FogPhase, IsReciprocalToItsShape) {
  Rng rng(5);
  FogParams fog;
  fog.has_shape = true, fog.sggx = {1, 0.1f, 0.3f, 0, 0.2f, 0};
  const Sggx shape(fog.sggx);
  for (int i = 0; i < 50; ++i) {
    const vec3 wo(random_direction(rng)), wi(random_direction(rng));
    const float there = shape.sigma(wo) * FogPhase(fog, wo).eval(wi, rng).x;
    EXPECT_NEAR(there, shape.sigma(wi) * FogPhase(fog, wi).eval(wo, rng).x, 1e-5f * there);
  }
}

TEST(FogPhase, ExtremesStayFinite) {
  Rng rng(6);
  for (FogParams fog : {FogParams{vec3(0.0f), 0.0f, -0.98f, true, {}}, FogParams{vec3(1.0f), 1e-9f, 0.98f, true, {NAN}},
                        FogParams{vec3(NAN), 1.0f, 0.0f, true, SymMat3::outer(vec3(0, 0, 1))}}) {
    const FogPhase phase(fog, vec3(0, 0, 1));
    for (const vec3 wi : {vec3(0, 0, 1), vec3(0, 0, -1), vec3(1, 0, 0)}) {
      EXPECT_TRUE(is_finite(phase.eval(wi, rng)));
      EXPECT_TRUE(std::isfinite(phase.pdf(wi)) && phase.pdf(wi) >= 0);
      EXPECT_TRUE(is_finite(phase.sample(rng).weight));
    }
  }
}

}  // namespace
}  // namespace farfield
