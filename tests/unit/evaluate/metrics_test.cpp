// SPDX-License-Identifier: Apache-2.0
// Errors of synthetic pictures whose true errors and noise are known.
#include "evaluate/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "base/random.h"
#include "base/vec.h"
#include "tests/support/pictures.h"

namespace farfield {
namespace {

using test::noisy_parts;
using test::picture;

Image constant(int size, const vec4& value) { return test::constant_picture(size, size, value); }

ErrorMetrics compare(const std::vector<Image>& source, const std::vector<Image>& level) {
  const auto sums = sum_view(source, level);
  EXPECT_TRUE(sums) << sums.error().message;
  return metrics_of(*sums);
}

ErrorMetrics compare_exact(const Image& source, const Image& level) {
  return compare(std::vector<Image>(kParts, source), std::vector<Image>(kParts, level));
}

TEST(ErrorMetrics, AreZeroWhenLevelAndSourceAreTheSame) {
  const ErrorMetrics m = compare_exact(constant(8, {0.2f, 0.3f, 0.4f, 0.5f}), constant(8, {0.2f, 0.3f, 0.4f, 0.5f}));
  EXPECT_EQ(m.occlusion_error.value, 0.0);
  EXPECT_EQ(m.occlusion_rms.value.value(), 0.0);
  EXPECT_EQ(m.color_error.value.value(), 0.0);
  EXPECT_EQ(m.color_noise, 0.0);
  EXPECT_EQ(m.color_rest.value.value(), 0.0);
}

TEST(ErrorMetrics, OcclusionErrorIsSignedAndRelative) {
  const Image half = constant(8, {0, 0, 0, 0.5f});
  EXPECT_NEAR(compare_exact(half, constant(8, {0, 0, 0, 0.55f})).occlusion_error.value, 0.1, 1e-6);
  EXPECT_NEAR(compare_exact(half, constant(8, {0, 0, 0, 0.4f})).occlusion_error.value, -0.2, 1e-6);
}

TEST(ErrorMetrics, OcclusionThatMovesIsSeenByTheRmsOnly) {
  const auto stripes = [](int phase) {
    return picture(16, 16, [phase](int x, int) { return vec4(0, 0, 0, (x + phase) % 2 ? 0.75f : 0.25f); });
  };
  const ErrorMetrics m = compare_exact(stripes(0), stripes(1));
  EXPECT_NEAR(m.occlusion_error.value, 0.0, 1e-9);
  EXPECT_NEAR(m.occlusion_rms.value.value(), 0.5, 1e-6);
  EXPECT_NEAR(m.occlusion_rms_raw, 0.5, 1e-6);
}

TEST(ErrorMetrics, AUniformColorShiftIsAllBias) {
  const Image source = picture(16, 16, [](int x, int y) { return vec4(0.1f * float(x), 0.2f * float(y), 0.5f, 1.0f); });
  const Image level =
      picture(16, 16, [](int x, int y) { return vec4(0.11f * float(x), 0.16f * float(y), 0.5f, 1.0f); });
  const ErrorMetrics m = compare_exact(source, level);
  EXPECT_NEAR(m.color_bias[0].value, 0.1, 1e-5);
  EXPECT_NEAR(m.color_bias[1].value, -0.2, 1e-5);
  EXPECT_NEAR(m.color_bias[2].value, 0.0, 1e-6);
  EXPECT_NEAR(m.color_rest.value.value(), 0.0, 1e-5);
  // sum|.|: 0.1 of the red light and 0.2 of the green.
  const double red = 0.1 * 7.5, green = 0.2 * 7.5, blue = 0.5;
  EXPECT_NEAR(m.color_error.value.value(), (0.1 * red + 0.2 * green) / (red + green + blue), 1e-5);
}

TEST(ErrorMetrics, AColorPatternThatMovesIsAllRest) {
  const auto stripes = [](int phase) {
    return picture(16, 16, [phase](int x, int) {
      return (x + phase) % 2 ? vec4(0.6f, 0.6f, 0.6f, 1) : vec4(0.4f, 0.4f, 0.4f, 1);
    });
  };
  const ErrorMetrics m = compare_exact(stripes(0), stripes(1));
  for (const Estimate& bias : m.color_bias) EXPECT_NEAR(bias.value, 0.0, 1e-6);
  EXPECT_NEAR(m.color_error.value.value(), 0.4, 1e-5);
  EXPECT_NEAR(m.color_rest.value.value(), 0.4, 1e-5);
}

TEST(ErrorMetrics, NoiseAloneIsUnknownWithBoundsFarBelowIt) {
  // 64 x 64 pixels x 3 channels, noise of 20 % of the light in both pictures, no true difference.
  const Image truth = constant(64, {0.5f, 0.5f, 0.5f, 0.5f});
  const ErrorMetrics m = compare(noisy_parts(truth, 0.1f, 1), noisy_parts(truth, 0.1f, 2));
  const double folded = std::sqrt(2.0 / 3.14159265358979) * 0.1 * std::sqrt(2.0) / 0.5;  // E|noise| / light
  EXPECT_NEAR(m.color_error_raw, folded, 0.03 * folded);
  EXPECT_NEAR(m.color_noise, folded, 0.03 * folded);
  EXPECT_LT(std::abs(m.color_error_low), 0.03 * folded);
  for (const Bounded& size :
       {m.color_error, m.color_rest, m.occlusion_rms, m.color_rms[0], m.color_rms[1], m.color_rms[2]}) {
    EXPECT_FALSE(size.value) << *size.value;
    EXPECT_EQ(size.low, 0.0);
    EXPECT_GT(size.high, 0.0);
  }
  // What can hide is the root of a statistical zero: n^(-1/4) of the noise.
  EXPECT_LT(m.color_error.high, 0.4 * folded);
  EXPECT_LT(m.occlusion_rms.high, 0.4 * m.occlusion_rms_raw);
}

TEST(ErrorMetrics, GaussianErrorIsRecoveredUnderNoiseOfAnySize) {
  // True differences are Gaussian with sd 0.05 on light 0.5: sum|d| / sum = sqrt(2/pi) * 0.1.
  const int size = 128;
  Rng rng(7);
  const Image source = constant(size, {0.5f, 0.5f, 0.5f, 0.5f});
  Image level = source;
  for (float& value : level.values) value += 0.05f * test::normal(rng);
  const double truth = compare_exact(source, level).color_error.value.value();
  EXPECT_NEAR(truth, std::sqrt(2.0 / 3.14159265358979) * 0.1, 0.001);
  for (const float sigma : {0.01f, 0.03f, 0.05f, 0.1f}) {
    const ErrorMetrics m = compare(noisy_parts(source, sigma, 11), noisy_parts(level, sigma, 12));
    EXPECT_GT(m.color_error_raw, truth) << sigma;
    EXPECT_LT(m.color_error_low, truth) << sigma;
    EXPECT_NEAR(m.color_error.value.value(), truth, 0.03 * truth) << sigma;
    EXPECT_NEAR(m.occlusion_rms.value.value(), 0.05, 0.003) << sigma;
  }
}

TEST(ErrorMetrics, MixtureOfWrongAndRightPixelsLiesBetweenTheBounds) {
  // A tenth of the pixels is wrong by 0.3, the others are exact: no Gaussian at all.
  const Image source = constant(100, {0.5f, 0.5f, 0.5f, 1.0f});
  const Image level =
      picture(100, 100, [](int x, int) { return x < 10 ? vec4(0.8f, 0.8f, 0.8f, 1) : vec4(0.5f, 0.5f, 0.5f, 1); });
  const double truth = 0.1 * 0.3 / 0.5;
  const ErrorMetrics m = compare(noisy_parts(source, 0.02f, 3), noisy_parts(level, 0.02f, 4));
  EXPECT_GT(m.color_error_raw, 1.5 * truth);
  EXPECT_NEAR(m.color_error_low, truth, 0.02 * truth);
  EXPECT_GT(m.color_error.value.value(), m.color_error_low);
  EXPECT_LT(m.color_error.value.value(), m.color_error_raw);
}

/// Noise as path tracers have it: rare and bright, so that a part is mostly 0 and sometimes 16.
std::vector<Image> rare_parts(const Image& truth, uint64_t seed) {
  Rng rng(seed);
  std::vector<Image> parts(kParts, truth);
  for (Image& part : parts)
    for (float& value : part.values) value *= rng.next() < 1.0f / 16.0f ? 16.0f : 0.0f;
  return parts;
}

TEST(ErrorMetrics, SquaresAndTheirStandardErrorsAreExactForRareBrightSamples) {
  // 40 % of the pixels are 50 % too bright: rms 0.5 sqrt(0.4) of the light, and after sums of blocks of them the same.
  constexpr int kRuns = 100;
  const Image source = constant(40, vec4(0.5f));
  const Image level = picture(40, 40, [](int x, int) { return vec4(x < 16 ? 0.75f : 0.5f); });
  for (const bool is_right : {false, true}) {
    const double truth = is_right ? 0.0 : 0.4 * 0.25 * 0.25;
    double sum = 0, squares = 0, claimed = 0;
    for (uint64_t run = 0; run < kRuns; ++run) {
      const ViewSums sums =
          sum_view(rare_parts(source, 2 * run), rare_parts(is_right ? source : level, 2 * run + 1)).value();
      const double square = sums.alpha[1].value / 400.0;
      sum += square / kRuns, squares += square * square / kRuns;
      claimed += sums.alpha[1].variance / (400.0 * 400.0) / kRuns;
    }
    const double spread = std::sqrt(squares - sum * sum);
    EXPECT_NEAR(sum, truth, 4.0 * spread / std::sqrt(kRuns)) << is_right;
    // 100 runs know the spread to 7 %; a few bright samples make the claim a little rough, too.
    EXPECT_NEAR(std::sqrt(claimed) / spread, 1.0, 0.25) << is_right;
  }
}

TEST(ErrorMetrics, ColorErrorIsNeverBelowTheBias) {
  // A shift of 10 % under noise of 40 %, which hides it in every pixel: by chance, squares alone would say less.
  const Image source = constant(48, vec4(0.5f)), level = constant(48, vec4(0.55f));
  int known = 0;
  for (uint64_t run = 0; run < 50; ++run) {
    const ErrorMetrics m = compare(noisy_parts(source, 0.2f, 2 * run), noisy_parts(level, 0.2f, 2 * run + 1));
    for (const Bounded& size : {m.color_error, m.color_rms[0], m.color_rms[1], m.color_rms[2]}) {
      EXPECT_GE(size.high, m.color_bias_mean.value);
      if (!size.value) continue;
      EXPECT_GE(*size.value, m.color_bias_mean.value);
      ++known;
    }
  }
  EXPECT_GT(known, 0);
}

TEST(ErrorMetrics, WhatIsCertainIsSeldomWrong) {
  // Bounds reach three standard errors, so that far fewer than one run of twenty may break them.
  const Image source = constant(32, vec4(0.5f)), level = constant(32, vec4(0.53f));
  int misses = 0, found_in_nothing = 0;
  double low = 0, low_squares = 0, claimed = 0;
  constexpr int kRuns = 200;
  for (uint64_t run = 0; run < kRuns; ++run) {
    const std::vector<Image> parts = noisy_parts(source, 0.05f, 3 * run);
    const ErrorMetrics m = compare(parts, noisy_parts(level, 0.05f, 3 * run + 1));
    misses += m.color_error.low > 0.06 || m.color_error.high < 0.06 ? 1 : 0;
    const ViewSums same = sum_view(parts, noisy_parts(source, 0.05f, 3 * run + 2)).value();
    found_in_nothing += metrics_of(same).color_error.value ? 1 : 0;
    low += same.sides.low / kRuns, low_squares += same.sides.low * same.sides.low / kRuns;
    claimed += same.sides.low_variance / kRuns;
  }
  EXPECT_LT(misses, kRuns / 50);
  EXPECT_LT(found_in_nothing, kRuns / 50);
  // The claim holds for channels that are noisy together; these are independent: a third of the variance.
  EXPECT_NEAR(std::sqrt(claimed / 3.0 / (low_squares - low * low)), 1.0, 0.25);
}

TEST(ErrorMetrics, SumsOverBlocksForgiveWhatMovesByAPixel) {
  const auto stripes = [](int phase) {
    return picture(16, 16, [phase](int x, int) { return (x + phase) % 2 ? vec4(0.75f) : vec4(0.25f); });
  };
  const ErrorMetrics m = compare_exact(stripes(0), stripes(1));
  EXPECT_NEAR(m.color_rms[0].value.value(), 1.0, 1e-6);
  EXPECT_NEAR(m.color_rms[1].value.value(), 0.0, 1e-6);
  EXPECT_NEAR(m.occlusion_rms_touched[0].value.value(), 0.5, 1e-6);
  EXPECT_NEAR(m.occlusion_rms_touched[2].value.value(), 0.0, 1e-6);
  // A shift of all is the same at every size.
  const ErrorMetrics shift = compare_exact(constant(10, vec4(0.5f)), constant(10, vec4(0.55f)));
  for (const Bounded& rms : shift.color_rms) EXPECT_NEAR(rms.value.value(), 0.1, 0.02);
}

TEST(ErrorMetrics, TouchedPixelsAreThoseOfSourceOrLevel) {
  // A quarter of the picture is covered by half, and the level adds a column of 0.1 beside it.
  const Image source = picture(16, 8, [](int x, int) { return vec4(x < 4 ? 0.5f : 0.0f); });
  const Image level = picture(16, 8, [](int x, int) { return vec4(x < 4 ? 0.5f : (x == 4 ? 0.1f : 0.0f)); });
  const ErrorMetrics m = compare_exact(source, level);
  EXPECT_NEAR(m.occlusion_rms.value.value(), 0.1 / 4.0, 1e-6);
  EXPECT_NEAR(m.occlusion_rms_touched[0].value.value(), 0.1 / std::sqrt(5.0), 1e-6);
}

TEST(ErrorMetrics, StandardErrorsMatchTheSpreadOverSeeds) {
  const Image source = constant(24, {0.5f, 0.4f, 0.3f, 0.5f});
  const Image level = constant(24, {0.52f, 0.41f, 0.29f, 0.49f});
  constexpr int kRuns = 200;
  double occlusion_sum = 0, occlusion_squares = 0, claimed = 0;
  for (int run = 0; run < kRuns; ++run) {
    const auto seed = static_cast<uint64_t>(run);
    const ErrorMetrics m = compare(noisy_parts(source, 0.1f, 2 * seed), noisy_parts(level, 0.1f, 2 * seed + 1));
    occlusion_sum += m.occlusion_error.value / kRuns;
    occlusion_squares += m.occlusion_error.value * m.occlusion_error.value / kRuns;
    claimed += m.occlusion_error.standard_error * m.occlusion_error.standard_error / kRuns;
  }
  const double spread = std::sqrt(occlusion_squares - occlusion_sum * occlusion_sum);
  // 200 runs know the spread to 5 %.
  EXPECT_NEAR(std::sqrt(claimed) / spread, 1.0, 0.2);
  EXPECT_NEAR(occlusion_sum, -0.02, 4.0 * spread / std::sqrt(kRuns));
}

TEST(ErrorMetrics, ViewsAddUpAsOnePicture) {
  const std::vector<Image> bright(kParts, constant(4, {1, 1, 1, 1})), dark(kParts, constant(4, {0.5f, 0.5f, 0.5f, 1}));
  ViewSums sums = sum_view(bright, bright).value();
  sums += sum_view(bright, dark).value();
  const ErrorMetrics m = metrics_of(sums);
  EXPECT_NEAR(m.color_error.value.value(), 0.25, 1e-6);
  EXPECT_NEAR(m.color_bias[1].value, -0.25, 1e-6);
  EXPECT_NEAR(m.color_rms[0].value.value(), 0.5 * std::sqrt(0.5), 1e-6);
}

TEST(ErrorMetrics, EmptySourceIsInfinitelyWrongOnlyIfTheLevelIsNotEmpty) {
  const Image nothing = constant(4, vec4(0.0f)), something = constant(4, {0.1f, 0, 0, 0.1f});
  const ErrorMetrics both = compare_exact(nothing, nothing);
  EXPECT_EQ(both.occlusion_error.value, 0.0);
  EXPECT_FALSE(both.color_error.value);  // a share of nothing
  const ErrorMetrics one = compare_exact(nothing, something);
  EXPECT_EQ(one.occlusion_error.value, std::numeric_limits<double>::infinity());
  EXPECT_EQ(one.color_bias[0].value, std::numeric_limits<double>::infinity());
  EXPECT_EQ(one.color_bias[1].value, 0.0);
}

TEST(ErrorMetrics, NoiseInOnePixelIsNoError) {
  // Four parts that happen to agree in one pixel of many: sharp by their own spread, and yet a single sample.
  const Image truth = constant(16, vec4(0.5f));
  std::vector<Image> parts = noisy_parts(truth, 0.001f, 1);
  const float bright[] = {1.0f, 1.6f, 0.8f, 1.2f};
  for (size_t part = 0; part < kParts; ++part)
    for (int c = 0; c < 3; ++c) parts[part].pixel(3, 3)[c] = bright[part];
  const ErrorMetrics m = compare(noisy_parts(truth, 0.001f, 2), parts);
  for (const Bounded& rms : m.color_rms) {
    EXPECT_FALSE(rms.value) << *rms.value;
    EXPECT_GT(rms.high, 0.02);
  }
}

TEST(ErrorMetrics, WithoutViewsAreUnknown) {
  const ErrorMetrics m = metrics_of({});
  EXPECT_FALSE(m.color_error.value);
  EXPECT_FALSE(m.occlusion_rms.value);
}

TEST(SumView, RefusesPicturesThatDoNotMatch) {
  const std::vector<Image> good(kParts, constant(4, vec4(0.5f)));
  const auto refuses = [&](const std::vector<Image>& source, const std::vector<Image>& level) {
    const auto sums = sum_view(source, level);
    return !sums && sums.error().code == ErrorCode::InvalidArgument;
  };
  EXPECT_FALSE(refuses(good, good));
  EXPECT_TRUE(refuses({}, {}));
  EXPECT_TRUE(refuses(std::vector<Image>(3, good[0]), std::vector<Image>(3, good[0])));
  EXPECT_TRUE(refuses(std::vector<Image>(5, good[0]), std::vector<Image>(5, good[0])));
  EXPECT_TRUE(refuses(good, std::vector<Image>(3, good[0])));
  EXPECT_TRUE(refuses(good, std::vector<Image>(kParts, constant(5, vec4(0.5f)))));
  EXPECT_TRUE(refuses(good, std::vector<Image>(kParts)));
  EXPECT_TRUE(refuses(good, std::vector<Image>(kParts, Image(4, 4, {"R", "G", "B"}))));
  std::vector<Image> broken = good;
  broken[2].values[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(refuses(good, broken));
}

TEST(MeanImage, IsTheMeanOfTheParts) {
  const std::vector<Image> parts = {constant(2, vec4(1.0f)), constant(2, vec4(0.0f)), constant(2, vec4(2.0f))};
  for (const float value : mean_image(parts).values) EXPECT_NEAR(value, 1.0f, 1e-6f);
  EXPECT_TRUE(mean_image({}).values.empty());
}

}  // namespace
}  // namespace farfield
