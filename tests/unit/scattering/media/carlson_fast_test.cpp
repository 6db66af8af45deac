// SPDX-License-Identifier: Apache-2.0
#include "scattering/media/carlson_fast.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "scattering/carlson.h"

namespace farfield {
namespace {

TEST(CarlsonRg, FastFitStaysWithinItsError) {
  double worst = 0;
  for (int i = 0; i <= 200; ++i) {
    for (int j = 0; j <= 200; ++j) {
      const double y = std::pow(i / 200.0, 4), z = std::pow(j / 200.0, 4);
      const double exact = carlson_rg(1.0, y, z);
      worst = std::max(worst, std::abs(carlson_rg_fast(1, float(y), float(z)) / exact - 1));
    }
  }
  EXPECT_LT(worst, 7e-4);
  EXPECT_GT(worst, 5e-4) << "the fit is better than documented";
  EXPECT_EQ(carlson_rg_fast(0, 0, 0), 0);
}

}  // namespace
}  // namespace farfield
