// SPDX-License-Identifier: Apache-2.0
#include "bake/pack_colors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace farfield {
namespace {

dvec3 mean_of(const std::vector<vec3>& colors, const std::vector<PackedColor>& packed, size_t phase, size_t period) {
  dvec3 sum(0.0);
  size_t count = 0;
  for (size_t i = phase; i < colors.size(); i += period, ++count) sum += dvec3(unpack_color(packed[i]));
  return sum / static_cast<double>(count);
}

std::vector<PackedColor> pack(const std::vector<vec3>& colors) {
  return pack_colors(colors, [](const vec3& c) { return c; });
}

TEST(PackColors, MeansAreRightWhereAStepIsSixPercent) {
  const vec3 dark(0.021f, 0.0703f, 0.4987f);
  const std::vector<vec3> colors(1000, dark);
  const dvec3 mean = mean_of(colors, pack(colors), 0, 1);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(mean[i], dark[i], 1e-3 * dark[i]);
}

TEST(PackColors, NoneIsFurtherThanAStepAway) {
  for (float c = 0; c < 1; c += 0.00037f) {
    ColorRounder round;
    for (int i = 0; i < 5; ++i) {
      const float root = 255 * std::sqrt(c);
      EXPECT_LT(std::abs(static_cast<float>(round(vec3(c)).sqrt_rgb[0]) - root), 1.001f);
    }
  }
}

TEST(PackColors, LightOnesDoNotPayForDarkOnes) {
  std::vector<vec3> colors;
  for (int i = 0; i < 4000; ++i) colors.emplace_back(i % 2 ? vec3(0.9012f) : vec3(0.0113f));
  const auto packed = pack(colors);
  EXPECT_NEAR(mean_of(colors, packed, 0, 1).x, 0.5 * (0.9012 + 0.0113), 1e-4);
  EXPECT_NEAR(mean_of(colors, packed, 0, 2).x, 0.0113, 0.0113 * 0.05);
}

TEST(PackColors, WhatBytesCanSayStaysAndNothingPoisonsTheNext) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  ColorRounder round;
  EXPECT_EQ(round(vec3(nan, inf, -inf)), (PackedColor{{0, 255, 0}}));
  for (int code = 0; code < 256; ++code) {
    const auto byte = static_cast<uint8_t>(code);
    const PackedColor color{{byte, 0, 255}};
    EXPECT_EQ(round(unpack_color(color)), color);
  }
}

}  // namespace
}  // namespace farfield
