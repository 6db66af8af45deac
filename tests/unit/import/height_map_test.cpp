// SPDX-License-Identifier: Apache-2.0
#include "import/height_map.h"
#include "base/nonfinite.h"

#include <gtest/gtest.h>

#include <cmath>

namespace farfield {
namespace {

float at(const HeightMap& map, float u, float v, float footprint = 1, Wrap wrap = Wrap::Repeat) {
  return map.at({u, v}, footprint, wrap, wrap);
}

TEST(HeightMap, KeepsNegativeAndLargeValuesAndIsBilinearBetweenTexels) {
  const HeightMap map(2, 1, {-3, 100});
  EXPECT_EQ(map.least(), -3);
  EXPECT_EQ(map.most(), 100);
  EXPECT_FLOAT_EQ(at(map, 0.25f, 0.5f), -3);
  EXPECT_FLOAT_EQ(at(map, 0.75f, 0.5f), 100);
  EXPECT_FLOAT_EQ(at(map, 0.5f, 0.5f), 48.5f);
}

TEST(HeightMap, VPointsDownTheImage) {
  const HeightMap map(1, 4, {0, 1, 2, 3});
  EXPECT_FLOAT_EQ(at(map, 0.5f, 0.125f), 0);
  EXPECT_FLOAT_EQ(at(map, 0.5f, 0.875f), 3);
}

TEST(HeightMap, ContinuesOutsideAsItsWrapSays) {
  const HeightMap map(4, 1, {0, 1, 2, 3});
  EXPECT_FLOAT_EQ(at(map, 1.125f, 0.5f, 1, Wrap::Repeat), 0);
  EXPECT_FLOAT_EQ(at(map, -0.125f, 0.5f, 1, Wrap::Repeat), 3);
  EXPECT_FLOAT_EQ(at(map, 0.0f, 0.5f, 1, Wrap::Repeat), 1.5f) << "half way from the last to the first";
  EXPECT_FLOAT_EQ(at(map, 1.125f, 0.5f, 1, Wrap::Mirror), 3);
  EXPECT_FLOAT_EQ(at(map, 2.125f, 0.5f, 1, Wrap::Mirror), 0);
  EXPECT_FLOAT_EQ(at(map, 7.0f, 0.5f, 1, Wrap::Clamp), 3);
  EXPECT_FLOAT_EQ(at(map, -7.0f, 0.5f, 1, Wrap::Clamp), 0);
  EXPECT_TRUE(std::isfinite(at(map, 1e30f, -1e30f)));
}

TEST(HeightMap, WideFootprintsGetMeansAndTheWholeMapItsMean) {
  const HeightMap map(5, 3, {1, 2, 3, 4, 5, 1, 2, 3, 4, 5, 1, 2, 3, 4, 5});
  EXPECT_NEAR(at(map, 0.3f, 0.7f, 1e9f), 3, 1e-6);
  const HeightMap checker(4, 4, {0, 1, 0, 1, 1, 0, 1, 0, 0, 1, 0, 1, 1, 0, 1, 0});
  for (const float u : {0.125f, 0.3f, 0.71f}) EXPECT_FLOAT_EQ(at(checker, u, 0.4f, 2), 0.5f);
}

TEST(HeightMap, HolesTakeTheMeanAroundThemAndAreCounted) {
  const HeightMap map(4, 2, {1, 3, kNan, 7, 1, 3, kInfinity, -kInfinity});
  EXPECT_EQ(map.mended_count(), 3u);
  EXPECT_EQ(map.first_mended(), 2u);
  EXPECT_FLOAT_EQ(at(map, 0.125f, 0.25f), 1);
  EXPECT_FLOAT_EQ(at(map, 0.625f, 0.75f), 7) << "the only finite one of its square";
  EXPECT_EQ(map.least(), 1);
  EXPECT_EQ(map.most(), 7);
}

TEST(HeightMap, WithoutAnyFiniteValueItIsFlat) {
  const HeightMap map(2, 2, {kNan, kNan, kInfinity, kNan});
  EXPECT_EQ(map.mended_count(), 4u);
  EXPECT_EQ(at(map, 0.3f, 0.3f), 0);
  EXPECT_EQ(map.least(), 0);
  EXPECT_EQ(map.most(), 0);
}

TEST(HeightMap, OneTexelIsOneHeight) {
  const HeightMap map(1, 1, {0.25f});
  EXPECT_EQ(at(map, 0.9f, 12.3f, 1e-3f), 0.25f);
  EXPECT_EQ(at(map, 0.9f, 12.3f, 64), 0.25f);
}

}  // namespace
}  // namespace farfield
