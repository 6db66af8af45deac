// SPDX-License-Identifier: Apache-2.0
#include "scattering/fresnel.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

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
