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

namespace farfield {
namespace {

const std::vector<std::string> kRgba = {"R", "G", "B", "A"};
constexpr int kParts = 4;

/// A picture from its pixels.
Image picture(int width, int height, const std::function<vec4(int x, int y)>& pixel) {
  Image image(width, height, kRgba);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const vec4 value = pixel(x, y);
      for (int c = 0; c < 4; ++c) image.pixel(x, y)[c] = value[c];
    }
  return image;
}

Image constant(int size, const vec4& value) {
  return picture(size, size, [&](int, int) { return value; });
}

float normal(Rng& rng) {  // Box and Muller
  const float u = 1.0f - rng.next(), v = rng.next();
  return std::sqrt(-2.0f * std::log(u)) * std::cos(2.0f * kPi * v);
}

/// Independent parts of the picture: Gaussian noise such that their mean has noise of standard deviation sigma.
std::vector<Image> noisy_parts(const Image& truth, float sigma, uint64_t seed) {
  Rng rng(seed);
  std::vector<Image> parts(kParts, truth);
  for (Image& part : parts)
    for (float& value : part.values) value += sigma * std::sqrt(static_cast<float>(kParts)) * normal(rng);
  return parts;
}

ErrorMetrics compare(const std::vector<Image>& source, const std::vector<Image>& level) {
  ErrorAccumulator accumulator;
  const auto added = accumulator.add_view(source, level);
  EXPECT_TRUE(added) << added.error().message;
  return accumulator.metrics();
}

ErrorMetrics compare_exact(const Image& source, const Image& level) {
  return compare(std::vector<Image>(kParts, source), std::vector<Image>(kParts, level));
}

TEST(ErrorMetrics, AreZeroWhenLevelAndSourceAreTheSame) {
  const ErrorMetrics m = compare_exact(constant(8, {0.2f, 0.3f, 0.4f, 0.5f}), constant(8, {0.2f, 0.3f, 0.4f, 0.5f}));
  EXPECT_EQ(m.occlusion_error.value, 0.0);
  EXPECT_EQ(m.occlusion_rms.value, 0.0);
  EXPECT_EQ(m.color_error.value, 0.0);
  EXPECT_EQ(m.color_noise, 0.0);
  EXPECT_EQ(m.color_rest.value, 0.0);
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
  EXPECT_NEAR(m.occlusion_rms.value, 0.5, 1e-6);
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
  EXPECT_NEAR(m.color_rest.value, 0.0, 1e-5);
  // sum|.|: 0.1 of the red light and 0.2 of the green.
  const double red = 0.1 * 7.5, green = 0.2 * 7.5, blue = 0.5;
  EXPECT_NEAR(m.color_error.value, (0.1 * red + 0.2 * green) / (red + green + blue), 1e-5);
}

TEST(ErrorMetrics, AColorPatternThatMovesIsAllRest) {
  const auto stripes = [](int phase) {
    return picture(16, 16, [phase](int x, int) {
      return (x + phase) % 2 ? vec4(0.6f, 0.6f, 0.6f, 1) : vec4(0.4f, 0.4f, 0.4f, 1);
    });
  };
  const ErrorMetrics m = compare_exact(stripes(0), stripes(1));
  for (const Estimate& bias : m.color_bias) EXPECT_NEAR(bias.value, 0.0, 1e-6);
  EXPECT_NEAR(m.color_error.value, 0.4, 1e-5);
  EXPECT_NEAR(m.color_rest.value, 0.4, 1e-5);
}

TEST(ErrorMetrics, NoiseAloneIsNoError) {
  // 64 x 64 pixels x 3 channels, noise of 20 % of the light in both pictures, no true difference.
  const Image truth = constant(64, {0.5f, 0.5f, 0.5f, 0.5f});
  const ErrorMetrics m = compare(noisy_parts(truth, 0.1f, 1), noisy_parts(truth, 0.1f, 2));
  const double folded = std::sqrt(2.0 / 3.14159265358979) * 0.1 * std::sqrt(2.0) / 0.5;  // E|noise| / light
  EXPECT_NEAR(m.color_error_raw, folded, 0.03 * folded);
  EXPECT_NEAR(m.color_noise, folded, 0.03 * folded);
  // What remains is the square root of a statistical zero: n^(-1/4) of the noise.
  EXPECT_LT(m.color_error.value, 0.2 * folded);
  EXPECT_LT(std::abs(m.color_error_low), 0.03 * folded);
  EXPECT_LT(m.occlusion_rms.value, 0.2 * m.occlusion_rms_raw);
}

TEST(ErrorMetrics, GaussianErrorIsRecoveredUnderNoiseOfAnySize) {
  // True differences are Gaussian with sd 0.05 on light 0.5: sum|d| / sum = sqrt(2/pi) * 0.1.
  const int size = 128;
  Rng rng(7);
  const Image source = constant(size, {0.5f, 0.5f, 0.5f, 0.5f});
  Image level = source;
  for (float& value : level.values) value += 0.05f * normal(rng);
  const double truth = compare_exact(source, level).color_error.value;
  EXPECT_NEAR(truth, std::sqrt(2.0 / 3.14159265358979) * 0.1, 0.001);
  for (const float sigma : {0.01f, 0.03f, 0.05f, 0.1f}) {
    const ErrorMetrics m = compare(noisy_parts(source, sigma, 11), noisy_parts(level, sigma, 12));
    EXPECT_GT(m.color_error_raw, truth) << sigma;
    EXPECT_LT(m.color_error_low, truth) << sigma;
    EXPECT_NEAR(m.color_error.value, truth, 0.03 * truth) << sigma;
    EXPECT_NEAR(m.occlusion_rms.value, 0.05, 0.003) << sigma;
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
  EXPECT_GT(m.color_error.value, m.color_error_low);
  EXPECT_LT(m.color_error.value, m.color_error_raw);
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
  // 200 runs know the spread to 5 %, 200 jackknifes of 4 know the mean variance to 6 %.
  EXPECT_NEAR(std::sqrt(claimed) / spread, 1.0, 0.2);
  EXPECT_NEAR(occlusion_sum, -0.02, 4.0 * spread / std::sqrt(kRuns));
}

TEST(ErrorMetrics, ViewsAddUpAsOnePicture) {
  ErrorAccumulator accumulator;
  const std::vector<Image> bright(kParts, constant(4, {1, 1, 1, 1})), dark(kParts, constant(4, {0.5f, 0.5f, 0.5f, 1}));
  ASSERT_TRUE(accumulator.add_view(bright, bright));
  ASSERT_TRUE(accumulator.add_view(bright, dark));
  const ErrorMetrics m = accumulator.metrics();
  EXPECT_NEAR(m.color_error.value, 0.25, 1e-6);
  EXPECT_NEAR(m.color_bias[1].value, -0.25, 1e-6);
}

TEST(ErrorMetrics, EmptySourceIsInfinitelyWrongOnlyIfTheLevelIsNotEmpty) {
  const Image nothing = constant(4, vec4(0.0f)), something = constant(4, {0.1f, 0, 0, 0.1f});
  const ErrorMetrics both = compare_exact(nothing, nothing);
  EXPECT_EQ(both.occlusion_error.value, 0.0);
  EXPECT_EQ(both.color_error.value, 0.0);
  const ErrorMetrics one = compare_exact(nothing, something);
  EXPECT_EQ(one.occlusion_error.value, std::numeric_limits<double>::infinity());
  EXPECT_EQ(one.color_bias[0].value, std::numeric_limits<double>::infinity());
  EXPECT_EQ(one.color_bias[1].value, 0.0);
}

TEST(ErrorMetrics, WithoutViewsAreZero) { EXPECT_EQ(ErrorAccumulator().metrics().color_error.value, 0.0); }

TEST(ErrorAccumulator, RefusesPicturesThatDoNotMatch) {
  const std::vector<Image> good(kParts, constant(4, vec4(0.5f)));
  const auto refuses = [&](const std::vector<Image>& source, const std::vector<Image>& level) {
    ErrorAccumulator accumulator;
    const auto added = accumulator.add_view(source, level);
    return !added && added.error().code == ErrorCode::InvalidArgument;
  };
  EXPECT_TRUE(refuses({}, {}));
  EXPECT_TRUE(refuses(std::vector<Image>(2, good[0]), std::vector<Image>(2, good[0])));
  EXPECT_TRUE(refuses(std::vector<Image>(17, good[0]), std::vector<Image>(17, good[0])));
  EXPECT_TRUE(refuses(good, std::vector<Image>(3, good[0])));
  EXPECT_TRUE(refuses(good, std::vector<Image>(kParts, constant(5, vec4(0.5f)))));
  EXPECT_TRUE(refuses(good, std::vector<Image>(kParts)));
  EXPECT_TRUE(refuses(good, std::vector<Image>(kParts, Image(4, 4, {"R", "G", "B"}))));
  std::vector<Image> broken = good;
  broken[2].values[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(refuses(good, broken));

  ErrorAccumulator accumulator;
  ASSERT_TRUE(accumulator.add_view(good, good));
  EXPECT_FALSE(accumulator.add_view(std::vector<Image>(3, good[0]), std::vector<Image>(3, good[0])));
}

TEST(MeanImage, IsTheMeanOfTheParts) {
  const std::vector<Image> parts = {constant(2, vec4(1.0f)), constant(2, vec4(0.0f)), constant(2, vec4(2.0f))};
  for (const float value : mean_image(parts).values) EXPECT_NEAR(value, 1.0f, 1e-6f);
  EXPECT_TRUE(mean_image({}).values.empty());
}

}  // namespace
}  // namespace farfield
