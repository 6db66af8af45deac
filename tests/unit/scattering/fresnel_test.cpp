// SPDX-License-Identifier: Apache-2.0
#include "scattering/fresnel.h"

#include <gtest/gtest.h>

#include "scattering/microfacet.h"

namespace farfield {
namespace {

TEST(VisibleFresnel, IsTheMeanOverVisibleFacets) {
  double low = 0, high = 0;
  for (const float alpha : {0.01f, 0.1f, 0.33f, 0.8f, 1.0f}) {
    const BasicMicrofacets<double> facets(SymMat3{alpha * alpha, alpha * alpha, 1, 0, 0, 0}, dvec3(0, 0, 1));
    for (const double cos : {1.0, 0.8, 0.6, 0.42, 0.25, 0.11, 0.05, 0.01}) {
      const dvec3 w(std::sqrt(1 - cos * cos), 0, cos);
      double sum = 0;
      const int n = 100;
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          const dvec3 m = facets.sample_visible(w, (i + 0.5) / n, (j + 0.5) / n);
          sum += std::pow(1 - glm::dot(w, m), 5) / (n * n);
        }
      }
      const double error = VisibleFresnel(alpha).grazing_share(float(cos)) - sum;
      low = std::min(low, error), high = std::max(high, error);
    }
  }
  EXPECT_GT(low, -0.02);
  EXPECT_LT(high, 0.02);
}

TEST(VisibleFresnel, MeanIsTheMeanOfTheTable) {
  for (const float alpha : {0.0f, 0.1f, 0.37f, 1.0f}) {
    const VisibleFresnel fresnel(alpha);
    double mean = 0;
    const int count = 100000;
    for (int i = 0; i < count; ++i) {
      const double cos = (i + 0.5) / count;
      mean += 2 * cos * fresnel.grazing_share(float(cos)) / count;
    }
    EXPECT_NEAR(fresnel.mean_grazing_share(), mean, 1e-6);
  }
  // Smooth facets: 1/21, up to what linear interpolation of 33 nodes adds.
  EXPECT_NEAR(VisibleFresnel(0).mean_grazing_share(), 1.0 / 21, 5e-4);
}

TEST(Fresnel, DielectricMeetsItsClosedForms) {
  EXPECT_NEAR(fresnel_dielectric(1, 1.5f), 0.04, 1e-6);
  EXPECT_NEAR(fresnel_dielectric(0, 1.5f), 1, 1e-6);
  EXPECT_NEAR(fresnel_dielectric(1, 1 / 1.5f), 0.04, 1e-6);
  EXPECT_EQ(fresnel_dielectric(0.5f, 1 / 1.5f), 1) << "total reflection";
  EXPECT_NEAR(fresnel_dielectric(0.3f, 1), 0, 1e-12);
  // At Brewster's angle only one polarisation is reflected: ((1 - eta^2) / (1 + eta^2))^2 / 2.
  const double across = (1 - 2.25) / (1 + 2.25);
  EXPECT_NEAR(fresnel_dielectric(float(1 / std::sqrt(1 + 2.25)), 1.5f), across * across / 2, 1e-6);
}

TEST(Fresnel, ConductorMeetsItsClosedForms) {
  const double eta = 0.2, k = 3.9;  // near silver
  const double normal = ((eta - 1) * (eta - 1) + k * k) / ((eta + 1) * (eta + 1) + k * k);
  EXPECT_NEAR(fresnel_conductor(1, float(eta), float(k)), normal, 1e-5);
  EXPECT_NEAR(fresnel_conductor(0, float(eta), float(k)), 1, 1e-6);
  for (const float cos : {0.05f, 0.3f, 0.7f, 1.0f}) {
    EXPECT_NEAR(fresnel_conductor(cos, 1.5f, 0), fresnel_dielectric(cos, 1.5f), 1e-5) << "no absorption";
    EXPECT_LE(fresnel_conductor(cos, float(eta), float(k)), 1);
  }
}

TEST(Schlick, HasItsEnds) {
  const vec3 f0(0.04f, 0.5f, 1.0f);
  EXPECT_EQ(schlick(f0, 1, 1), f0);
  EXPECT_EQ(schlick(f0, 1, 0), vec3(1.0f));
  EXPECT_EQ(grazing_reflectance(vec3(0.0f)), 0);
  EXPECT_EQ(grazing_reflectance(f0), 1);
  EXPECT_NEAR(grazing_reflectance(vec3(0.02f)), 0.5, 1e-6);
}

}  // namespace
}  // namespace farfield
