// SPDX-License-Identifier: Apache-2.0
// Distributions of depth whose distance is known.
#include "evaluate/depth.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace farfield {
namespace {

constexpr size_t kRays = 1 << 15;

/// Depths uniform in [begin, end) of the range 1.
DepthHistogram uniform(float begin, float end, uint64_t seed) {
  Rng rng(seed);
  DepthHistogram histogram;
  for (size_t ray = 0; ray < kRays; ++ray) histogram.add(ray, begin + (end - begin) * rng.next(), 1.0f);
  return histogram;
}

DepthFigures compare(const DepthHistogram& source, const DepthHistogram& level) {
  const DepthPair pair{source, level, 2.0};  // twice the asset's size
  return compare_depths({&pair, 1});
}

TEST(CompareDepths, AShiftIsMeanAndDistance) {
  const DepthFigures figures = compare(uniform(0.2f, 0.6f, 1), uniform(0.25f, 0.65f, 2));
  EXPECT_NEAR(figures.mean.value, 0.1, 4 * figures.mean.standard_error);
  EXPECT_LT(figures.mean.standard_error, 0.003);
  ASSERT_TRUE(figures.distance.value);
  EXPECT_NEAR(*figures.distance.value, 0.1, 0.005);
}

TEST(CompareDepths, ASpreadIsDistanceAlone) {
  // [0.3, 0.5) against [0.2, 0.6): the mean is the same, a quarter of the difference of the widths is moved.
  const DepthFigures figures = compare(uniform(0.3f, 0.5f, 3), uniform(0.2f, 0.6f, 4));
  EXPECT_NEAR(figures.mean.value, 0.0, 4 * figures.mean.standard_error);
  ASSERT_TRUE(figures.distance.value);
  EXPECT_NEAR(*figures.distance.value, 2.0 * 0.05, 0.005);
}

TEST(CompareDepths, NoiseIsNoDistance) {
  const DepthFigures figures = compare(uniform(0.2f, 0.6f, 5), uniform(0.2f, 0.6f, 6));
  EXPECT_FALSE(figures.distance.value);
  EXPECT_EQ(figures.distance.low, 0.0);
  EXPECT_GT(figures.distance.high, 0.0);
  EXPECT_LT(figures.distance.high, 0.01);
  EXPECT_LT(std::abs(figures.mean.value), 4 * figures.mean.standard_error);
}

TEST(CompareDepths, NothingIsKnownWithoutHits) {
  const DepthFigures figures = compare(uniform(0.2f, 0.6f, 7), DepthHistogram());
  EXPECT_FALSE(figures.distance.value);
  EXPECT_EQ(figures.distance.high, 1.0);
}

TEST(DepthHistogram, CountsWhatIsInRange) {
  DepthHistogram histogram;
  for (const float miss : {-0.1f, 2.0f, INFINITY, NAN}) histogram.add(0, miss, 2.0f);
  EXPECT_EQ(histogram.hits(0), 0.0);
  EXPECT_EQ(histogram.mean(0), 0.0);
  histogram.add(kDepthBatches + 3, 0.5f, 2.0f);
  EXPECT_EQ(histogram.hits(3), 1.0);
  EXPECT_EQ(histogram.mean(3), 0.25);
  EXPECT_EQ(histogram.cumulative(3)[kDepthBins / 4 - 1], 0.0);
  EXPECT_EQ(histogram.cumulative(3)[kDepthBins / 4], 1.0);
}

}  // namespace
}  // namespace farfield
