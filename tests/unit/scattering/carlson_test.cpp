// SPDX-License-Identifier: Apache-2.0
#include "scattering/carlson.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "scattering/convention.h"

namespace farfield {
namespace {

constexpr double kPiD = kPiOf<double>;

TEST(CarlsonRg, MeetsItsClosedForms) {
  EXPECT_NEAR(carlson_rg(1.0, 1.0, 1.0), 1, 1e-14);
  EXPECT_NEAR(carlson_rg(1.0, 1.0, 0.0), kPiD / 4, 1e-14);
  EXPECT_NEAR(carlson_rg(0.0, 1.0, 0.0), 0.5, 1e-15);
  EXPECT_EQ(carlson_rg(0.0, 0.0, 0.0), 0);
  for (const double b : {0.9, 0.5, 0.1, 1e-2, 1e-4, 1e-8, 1e-12}) {
    const double needle = 0.5 * (1 + b / std::sqrt(1 - b) * std::asinh(std::sqrt((1 - b) / b)));
    const double disk = 0.5 * (std::sqrt(b) + std::acos(std::sqrt(b)) / std::sqrt(1 - b));
    EXPECT_NEAR(carlson_rg(1.0, b, b), needle, 1e-14 * needle) << b;
    EXPECT_NEAR(carlson_rg(b, 1.0, 1.0), disk, 1e-14 * disk) << b;
  }
}

TEST(CarlsonRg, IsSymmetricAndHomogeneous) {
  const double reference = carlson_rg(0.3, 1.7, 0.02);
  EXPECT_DOUBLE_EQ(carlson_rg(1.7, 0.02, 0.3), reference);
  EXPECT_DOUBLE_EQ(carlson_rg(0.02, 0.3, 1.7), reference);
  EXPECT_NEAR(carlson_rg(0.3e10, 1.7e10, 0.02e10), 1e5 * reference, 1e-9);
  EXPECT_NEAR(carlson_rg(0.3e-10, 1.7e-10, 0.02e-10), 1e-5 * reference, 1e-19);
}

TEST(CarlsonRg, FloatAgreesWithDouble) {
  Rng rng(1);
  for (int i = 0; i < 10000; ++i) {
    const float x = std::pow(rng.next(), 6.0f), y = rng.next(), z = std::pow(rng.next(), 20.0f);
    EXPECT_NEAR(carlson_rg(x, y, z) / carlson_rg(double(x), double(y), double(z)), 1, 1e-6)
        << x << ' ' << y << ' ' << z;
  }
  EXPECT_EQ(carlson_rg(0.0f, 0.0f, 0.0f), 0);
  EXPECT_FLOAT_EQ(carlson_rg(0.0f, 4.0f, 0.0f), 1);
}

}  // namespace
}  // namespace farfield
