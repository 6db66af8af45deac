// SPDX-License-Identifier: Apache-2.0
#include "scattering/media/lobe_fit.h"

#include <gtest/gtest.h>

#include "scattering/carlson.h"
#include "scattering/sggx.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

// The table of docs/theory.md, section 3.6: eigenvalues, rms error of sigma, ratio of areas.
TEST(LobeFit, IsAsGoodAsTheReference) {
  struct Row {
    dvec3 eigen;
    double rms, area;
  };
  Rng rng(1);
  for (const Row& row : {Row{{1, 0.25, 0.25}, 0.004, 1}, Row{{1, 0.05, 0.05}, 0.008, 1}, Row{{1, 1, 0.1}, 0.004, 1},
                         Row{{1, 0.5, 0.1}, 0.012, 1}, Row{{1, 0.1, 0.01}, 0.05, 0.991}}) {
    for (int i = 0; i < 5; ++i) {
      const SymMat3 s = sggx_from(row.eigen, random_direction(rng));
      const LobeFit fit = fit_lobes(s);
      EXPECT_LT(fit.rms_error, row.rms) << row.eigen.y << ' ' << row.eigen.z;
      EXPECT_NEAR(fit.rho_factor / (4 * carlson_rg(row.eigen.x, row.eigen.y, row.eigen.z)), row.area, 0.01);
      // The error it reports is that of sigma over the sphere.
      double sum = 0;
      const int count = 4000;
      for (int k = 0; k < count; ++k) {
        const vec3 w(random_direction(rng));
        sum += std::pow(fit.rho_factor * fit.flakes.sigma(w) / Sggx(s).sigma(w) - 1, 2);
      }
      EXPECT_NEAR(std::sqrt(sum / count), fit.rms_error, 0.25 * fit.rms_error + 5e-4);
    }
  }
}

TEST(LobeFit, IsotropicIsExact) {
  const LobeFit fit = fit_lobes(SymMat3::identity() * 4.0f);
  EXPECT_LT(fit.rms_error, 1e-4);
  EXPECT_NEAR(fit.rho_factor, 8, 1e-2);
  EXPECT_NEAR(fit.rho_factor * fit.flakes.sigma({0, 1, 0}), 2, 1e-3);
}

TEST(LobeFit, ExtremesAreFinite) {
  EXPECT_EQ(fit_lobes(SymMat3{}).rho_factor, 0);
  for (const NamedSggx& s : sample_sggx()) {
    const LobeFit fit = fit_lobes(s.sggx);
    EXPECT_TRUE(std::isfinite(fit.rho_factor) && fit.rho_factor > 0) << s.name;
    EXPECT_TRUE(std::isfinite(fit.rms_error)) << s.name;
    EXPECT_TRUE(std::isfinite(fit.flakes.sigma(glm::normalize(vec3(1, 2, 3))))) << s.name;
  }
}

}  // namespace
}  // namespace farfield
