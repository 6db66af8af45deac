// SPDX-License-Identifier: Apache-2.0
// Figures of made-up shots whose errors, noise and pops are known.
#include "evaluate/trade_figures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/nonfinite.h"
#include "tests/support/pictures.h"

namespace farfield {
namespace {

constexpr int kSide = 48;

Image grey(float value) { return test::constant_picture(kSide, kSide, {value, value, value, 1}); }

/// A plane of `value` with stripes `height` above and below it: right on average, wrong by `height` in each pixel.
Image striped(float value, float height) {
  return test::picture(kSide, kSide, [&](int x, int) {
    const float v = value + (x % 2 == 0 ? height : -height);
    return vec4(v, v, v, 1);
  });
}

TradeErrors errors_of(const FrameParts& full, const FrameParts& setting) {
  TradeErrorSums sums;
  const auto added = sums.add_frame(full, setting);
  EXPECT_TRUE(added) << added.error().message;
  return sums.errors();
}

TEST(TradeErrors, BiasAndErrorPerPixelAreThoseOfThePicturesWithoutTheirNoise) {
  // Noise of 0.1 in the mean of the parts, twice the error of 0.05 per pixel.
  const TradeErrors errors =
      errors_of(test::noisy_parts(grey(0.5f), 0.1f, 1), test::noisy_parts(striped(0.55f, 0.05f), 0.1f, 2));
  for (const Estimate& bias : errors.all.color_bias)
    EXPECT_NEAR(bias.value, 0.1, 4 * bias.standard_error);  // seeds 1 and 2; four standard errors
  const double truth = std::hypot(0.05, 0.05) / 0.5;
  const Bounded& error = errors.all.color_rms[0];
  ASSERT_TRUE(error.value);
  EXPECT_NEAR(*error.value, truth, 4 * error.standard_error);
  EXPECT_LT(error.standard_error, 0.1 * truth);
  EXPECT_LT(error.low, truth);
  EXPECT_GT(error.high, truth);
}

TEST(TradeErrors, NoiseAloneIsNoError) {
  const TradeErrors errors = errors_of(test::noisy_parts(grey(0.5f), 0.1f, 3), test::noisy_parts(grey(0.5f), 0.1f, 4));
  EXPECT_FALSE(errors.all.color_rms[0].value);
  EXPECT_EQ(errors.all.color_rms[0].low, 0.0);
  EXPECT_LT(errors.all.color_rms[0].high, 0.1);  // of noise that is 0.28
}

TEST(TradeErrors, NoiseThatPartsShareDoesNotBlurTheBias) {
  const FrameParts full = test::noisy_parts(grey(0.5f), 0.1f, 5);
  FrameParts setting = full;
  for (Image& part : setting)
    for (size_t i = 0; i < part.values.size(); ++i) part.values[i] += i % 4 == 3 ? 0.0f : 0.005f;
  const TradeErrors errors = errors_of(full, setting);
  for (const Estimate& bias : errors.all.color_bias) {
    EXPECT_NEAR(bias.value, 0.01, 1e-3);
    EXPECT_LT(bias.standard_error, 1e-4);  // 0.006 if the parts were taken for independent
  }
}

TEST(TradeErrors, VarianceIsThatOfOnePictureOverTheSquaredLight) {
  const TradeErrors errors = errors_of(test::noisy_parts(grey(0.5f), 0.1f, 6), test::noisy_parts(grey(0.6f), 0.05f, 7));
  // noisy_parts gives the mean of four: one has twice the deviation. 2 % is three standard errors of so many pixels.
  EXPECT_NEAR(errors.all.full_variance, 0.2 * 0.2 / 0.25, 0.02 * 0.16);
  EXPECT_NEAR(errors.all.variance, 0.1 * 0.1 / 0.25, 0.02 * 0.04);
}

TEST(TradeErrors, FramesAreKeptApartAndJoined) {
  TradeErrorSums sums;
  const FrameParts full(kParts, grey(0.5f));
  ASSERT_TRUE(sums.add_frame(full, FrameParts(kParts, grey(0.55f))));
  ASSERT_TRUE(sums.add_frame(full, FrameParts(kParts, grey(0.5f))));
  const TradeErrors errors = sums.errors();
  ASSERT_EQ(errors.frames.size(), 2u);
  EXPECT_NEAR(errors.frames[0].color_bias[0].value, 0.1, 1e-6);
  EXPECT_EQ(errors.frames[1].color_bias[0].value, 0.0);
  EXPECT_NEAR(errors.all.color_bias[0].value, 0.05, 1e-6);
  EXPECT_FALSE(sums.add_frame(full, FrameParts(kParts, test::constant_picture(2, 2, vec4(1)))));
}

TEST(HideBackground, LeavesWhatAnyPictureTouches) {
  const auto sky_and_leaf = [](int leaf) {
    return test::picture(4, 1, [leaf](int x, int) { return vec4(0.7f, 0.8f, 0.9f, x == leaf ? 0.5f : 0.0f); });
  };
  FrameParts full(kParts, sky_and_leaf(0)), setting(kParts, sky_and_leaf(0));
  setting[2] = sky_and_leaf(3);
  hide_background(full, setting);
  for (const FrameParts& parts : {full, setting})
    for (const Image& part : parts) {
      EXPECT_EQ(part.pixel(0, 0)[0], 0.7f);
      EXPECT_EQ(part.pixel(3, 0)[2], 0.9f);
      for (const int x : {1, 2})
        for (int c = 0; c < 4; ++c) EXPECT_EQ(part.pixel(x, 0)[c], 0.0f);
    }
}

/// A shot of grey pictures: how much each frame is above the one before.
std::vector<Bounded> changes_of(const std::vector<float>& greys, float sigma, uint64_t seed) {
  std::vector<Bounded> changes;
  for (size_t i = 0; i + 1 < greys.size(); ++i) {
    const auto change = change_between(test::noisy_parts(grey(greys[i]), sigma, seed + i),
                                       test::noisy_parts(grey(greys[i + 1]), sigma, seed + 100 + i));
    EXPECT_TRUE(change);
    changes.push_back(*change);
  }
  return changes;
}

TEST(ShotPop, IsWhatChangesMoreThanAtFullDetailAtTheMost) {
  const std::vector<int> frames = {0, 5, 10, 15};
  // Both brighten by 10 % a frame; the setting by 30 % once.
  const auto full = changes_of({0.5f, 0.55f, 0.605f, 0.6655f}, 0.01f, 10);
  const auto setting = changes_of({0.5f, 0.55f, 0.715f, 0.7865f}, 0.01f, 1000);
  const ShotPop pop = pop_of(setting, full, frames);
  ASSERT_TRUE(pop.most.value);
  EXPECT_NEAR(*pop.most.value, 0.2, 0.01);
  EXPECT_EQ(pop.at, (std::array<int, 2>{5, 10}));
  ASSERT_EQ(pop.all.size(), 3u);
  EXPECT_NEAR(pop.all[0].value.value(), 0.0, 0.01);
}

TEST(ShotPop, IsUnknownWhereNoiseIsLargerThanAnyChange) {
  const std::vector<int> frames = {0, 1};
  const auto still = changes_of({0.5f, 0.5f}, 0.2f, 20), other = changes_of({0.5f, 0.5f}, 0.2f, 2000);
  const ShotPop pop = pop_of(still, other, frames);
  EXPECT_FALSE(pop.most.value);
  EXPECT_LE(pop.most.low, 0.0);
  EXPECT_GE(pop.most.high, 0.0);
}

TEST(ShotPop, OfKnownAndUnknownPairsIsKnownOnlyIfItSurelyIsTheMost) {
  const Bounded still{0.1, 0.1, 0.1, 0}, large{0.5, 0.5, 0.5, 0}, small_unknown{std::nullopt, 0.0, 0.2, 0},
      large_unknown{std::nullopt, 0.0, 0.9, 0};
  const std::vector<Bounded> full = {still, still};
  const std::vector<int> frames = {3, 4, 5};
  const ShotPop known = pop_of(std::vector<Bounded>{small_unknown, large}, full, frames);
  EXPECT_NEAR(known.most.value.value(), 0.4, 1e-9);
  EXPECT_EQ(known.at, (std::array<int, 2>{4, 5}));
  const ShotPop unknown = pop_of(std::vector<Bounded>{large_unknown, large}, full, frames);
  EXPECT_FALSE(unknown.most.value);
  EXPECT_NEAR(unknown.most.low, 0.4, 1e-9);
  EXPECT_NEAR(unknown.most.high, 0.8, 1e-9);
}

TEST(ShotPop, OfOneFrameIsNothing) { EXPECT_TRUE(pop_of({}, {}, std::vector<int>{7}).all.empty()); }

RenderReport report_of(std::vector<std::pair<int, double>> frames, uint64_t peak, uint64_t rss) {
  RenderReport report;
  report.peak_accounted_bytes = peak;
  report.baseline_rss_bytes = 1000;
  report.peak_rss_bytes = rss;
  for (const auto& [number, seconds] : frames) {
    FrameReport frame;
    frame.frame = number;
    frame.cpu_seconds = seconds;
    frame.seconds = seconds / 2;
    frame.load_seconds = seconds / 10;
    frame.rays = 100;
    report.frames.push_back(frame);
  }
  return report;
}

TEST(TradeCost, IsTheSumOverFramesOfMediansOverParts) {
  const std::vector<RenderReport> parts = {report_of({{0, 1}, {10, 9}, {99, 50}}, 70, 1500),
                                           report_of({{0, 100}, {10, 7}}, 90, 1400),
                                           report_of({{0, 3}, {10, 8}}, 80, 900)};  // below its baseline
  const TradeCost cost = cost_of(parts, std::vector<int>{0, 10});
  EXPECT_EQ(cost.frame_cpu_seconds, (std::vector<double>{3, 8}));
  EXPECT_EQ(cost.cpu_seconds, 11);
  EXPECT_EQ(cost.seconds, 5.5);
  EXPECT_NEAR(cost.load_seconds, 1.1, 1e-12);
  EXPECT_EQ(cost.rays, 200);
  EXPECT_EQ(cost.peak_accounted_bytes, 90u);
  EXPECT_EQ(cost.peak_rss_bytes, 500u);
  const TradeCost even = cost_of(std::span(parts).first(2), std::vector<int>{10});
  EXPECT_EQ(even.cpu_seconds, 8);
}

NoisyErrors noisy(double variance, double full_variance, const Bounded& error) {
  NoisyErrors errors;
  errors.variance = variance, errors.full_variance = full_variance;
  errors.color_rms[0] = error;
  return errors;
}

TEST(TimeToEqualError, IsTheTimeWhenNoiseAndOwnErrorTogetherAreFullDetailsNoise) {
  // Without an error of its own: as the product of time and variance.
  const Bounded none{0.0, 0, 0, 0};
  EXPECT_NEAR(time_to_equal_error(0.5, noisy(0.02, 0.04, none)).value.value(), 0.25, 1e-12);
  // 0.1^2 of 0.04 is the error: 0.03 are left for noise.
  const TimeRatio time = time_to_equal_error(0.5, noisy(0.02, 0.04, {0.1, 0.05, 0.15, 0}));
  const double samples = time.value.value() / 0.5;
  EXPECT_NEAR(0.1 * 0.1 + 0.02 / samples, 0.04, 1e-12);
  EXPECT_LT(time.low, *time.value);
  EXPECT_GT(time.high, *time.value);
}

TEST(TimeToEqualError, IsInfiniteWhereTheErrorIsLargerThanTheNoiseAndUnknownWhereTheErrorIs) {
  EXPECT_EQ(time_to_equal_error(0.5, noisy(0.02, 0.04, {0.2, 0.19, 0.21, 0})).value.value(), kInfinity);
  const TimeRatio unknown = time_to_equal_error(0.5, noisy(0.02, 0.04, {std::nullopt, 0, 0.3, 0}));
  EXPECT_FALSE(unknown.value);
  EXPECT_NEAR(unknown.low, 0.25, 1e-12);
  EXPECT_EQ(unknown.high, kInfinity);
  EXPECT_FALSE(time_to_equal_error(0.5, noisy(0, 0, {0.0, 0, 0, 0})).value) << "without noise there is no such time";
}

}  // namespace
}  // namespace farfield
