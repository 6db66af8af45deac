// SPDX-License-Identifier: Apache-2.0
#include "lodselect/planner.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/random.h"

namespace farfield {
namespace {

constexpr uint64_t kUnlimited = std::numeric_limits<uint64_t>::max();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

/// Levels 0, 1, 2, ... of the given sizes.
PlanAsset asset_of(std::vector<uint64_t> sizes, float wanted = 0, double pixels = 1) {
  PlanAsset asset;
  asset.build_peak_bytes.assign(sizes.size(), 0);
  for (size_t i = 0; i < sizes.size(); ++i) asset.lambda.push_back(static_cast<float>(i));
  asset.resident_bytes = std::move(sizes);
  asset.wanted_lambda = wanted;
  asset.pixels = pixels;
  return asset;
}

std::vector<PlanAsset> random_assets(uint64_t seed) {
  Rng rng(seed);
  std::vector<PlanAsset> assets(1 + rng.next_uint() % 12);
  for (PlanAsset& asset : assets) {
    const size_t levels = 1 + rng.next_uint() % 9;
    float lambda = 0;
    for (size_t i = 0; i < levels; ++i) {
      // Mostly shrinking by 3, sometimes not at all; sizes and peaks of 0 happen.
      const double size = 1e6 * std::pow(3.0, -static_cast<double>(i)) * rng.next();
      asset.resident_bytes.push_back(rng.next_uint() % 8 == 0 ? 0 : static_cast<uint64_t>(size));
      asset.build_peak_bytes.push_back(static_cast<uint64_t>(0.3 * size * rng.next()));
      asset.lambda.push_back(lambda);
      lambda += rng.next_uint() % 4 == 0 ? 2.0f : 1.0f;
    }
    asset.wanted_lambda = 12.0f * rng.next() - 2.0f;
    asset.pixels = rng.next_uint() % 6 == 0 ? 0.0 : 1000.0 * rng.next();
  }
  return assets;
}

uint64_t resident_bytes_of(std::span<const PlanAsset> assets, const std::vector<uint32_t>& finest) {
  uint64_t sum = 0;
  for (size_t i = 0; i < assets.size(); ++i) {
    for (size_t k = finest[i]; k < assets[i].resident_bytes.size(); ++k) sum += assets[i].resident_bytes[k];
  }
  return sum;
}

uint64_t peak_bytes_of(std::span<const PlanAsset> assets, const std::vector<uint32_t>& finest) {
  uint64_t peak = 0;
  for (size_t i = 0; i < assets.size(); ++i) {
    for (size_t k = finest[i]; k < assets[i].resident_bytes.size(); ++k) {
      peak = std::max(peak, assets[i].build_peak_bytes[k]);
    }
  }
  return peak;
}

std::vector<uint32_t> roots_of(std::span<const PlanAsset> assets) {
  std::vector<uint32_t> roots;
  for (const PlanAsset& asset : assets) roots.push_back(static_cast<uint32_t>(asset.resident_bytes.size() - 1));
  return roots;
}

TEST(PlanLevels, LargerBudgetNeverGivesAnyAssetACoarserLevel) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const std::vector<PlanAsset> assets = random_assets(seed);
    const uint64_t most = plan_levels(assets, kUnlimited, 0)->resident_bytes + 400000;
    std::vector<uint32_t> previous = roots_of(assets);
    double previous_bias = std::numeric_limits<double>::infinity();
    for (uint64_t budget = 0; budget <= most; budget += most / 97 + 1) {
      const Result<Plan> plan = plan_levels(assets, budget, 777);
      if (!plan) continue;
      for (size_t i = 0; i < assets.size(); ++i) ASSERT_LE(plan->finest[i], previous[i]) << "seed " << seed;
      ASSERT_LE(plan->bias, previous_bias);
      previous = plan->finest;
      previous_bias = plan->bias;
    }
  }
}

TEST(PlanLevels, FitsAndCountsWhatItAllows) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const std::vector<PlanAsset> assets = random_assets(seed);
    const uint64_t most = plan_levels(assets, kUnlimited, 0)->resident_bytes;
    for (uint64_t part = 1; part <= 8; ++part) {
      const uint64_t budget = most * part / 8 + 500;
      const Result<Plan> plan = plan_levels(assets, budget, 500);
      if (!plan) continue;
      EXPECT_EQ(plan->resident_bytes, resident_bytes_of(assets, plan->finest));
      EXPECT_EQ(plan->build_peak_bytes, peak_bytes_of(assets, plan->finest));
      EXPECT_LE(plan->resident_bytes + plan->build_peak_bytes + 500, budget);
    }
  }
}

/// 1234 in "... need 1.21 KiB (1234 bytes); ...".
uint64_t bytes_in_last_bracket(const std::string& message) {
  return std::stoull(message.substr(message.rfind('(') + 1));
}

TEST(PlanLevels, NumberInTheErrorIsTheSmallestBudgetThatWorks) {
  for (uint64_t seed = 0; seed < 100; ++seed) {
    const std::vector<PlanAsset> assets = random_assets(seed);
    const Result<Plan> refused = plan_levels(assets, 99, 100);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::OutOfBudget);
    const uint64_t needed = bytes_in_last_bracket(refused.error().message);
    const Result<Plan> plan = plan_levels(assets, needed, 100);
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_FALSE(plan_levels(assets, needed - 1, 100));
    EXPECT_EQ(needed, resident_bytes_of(assets, roots_of(assets)) + peak_bytes_of(assets, roots_of(assets)) + 100);
  }
}

TEST(PlanLevels, GivesWhatTheCamerasAskWhenThereIsRoom) {
  const std::vector<float> wanted = {-3.0f, 0.0f, 0.99f, 1.0f, 2.5f, 4.0f, 100.0f, kInf, -kInf, kNan};
  const std::vector<uint32_t> expected = {0, 0, 0, 1, 2, 4, 4, 4, 0, 0};
  std::vector<PlanAsset> assets;
  for (const float lambda : wanted) assets.push_back(asset_of({50, 40, 30, 20, 10}, lambda));
  const Result<Plan> plan = plan_levels(assets, kUnlimited, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->finest, expected);
  EXPECT_EQ(plan->bias, 0.0);
}

TEST(PlanLevels, TakesTheNextFinerLevelWhereOneIsSkipped) {
  PlanAsset asset = asset_of({50, 40, 10});
  asset.lambda = {0.0f, 1.0f, 4.0f};
  asset.wanted_lambda = 3.9f;
  EXPECT_EQ(plan_levels(std::span(&asset, 1), kUnlimited, 0)->finest[0], 1u);
}

/// Smallest total projected error of all plans that fit.
double best_error(std::span<const PlanAsset> assets, uint64_t budget) {
  std::vector<uint32_t> finest(assets.size(), 0);
  double best = std::numeric_limits<double>::infinity();
  for (;;) {
    if (resident_bytes_of(assets, finest) <= budget) {
      double error = 0;
      for (size_t i = 0; i < assets.size(); ++i) {
        const float lambda = assets[i].lambda[finest[i]];
        error += assets[i].pixels * std::exp2(std::max(0.0f, lambda - std::max(0.0f, assets[i].wanted_lambda)));
      }
      best = std::min(best, error);
    }
    size_t i = 0;
    while (i < finest.size() && ++finest[i] == assets[i].resident_bytes.size()) finest[i++] = 0;
    if (i == finest.size()) return best;
  }
}

TEST(PlanLevels, IsOptimalWhenAllLevelsHaveTheSameSize) {
  // Then steps cost equally much and prices rise along each asset (2^x is convex), so greedy is the best there is.
  Rng rng(5);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<PlanAsset> assets;
    for (int i = 0; i < 4; ++i) {
      assets.push_back(asset_of(std::vector<uint64_t>(5, 100), 5.0f * rng.next(), 10.0 * rng.next()));
    }
    for (uint64_t budget = 400; budget <= 2000; budget += 100) {
      const Result<Plan> plan = plan_levels(assets, budget, 0);
      ASSERT_TRUE(plan);
      double error = 0;
      for (size_t i = 0; i < assets.size(); ++i) {
        const float lambda = assets[i].lambda[plan->finest[i]];
        error += assets[i].pixels * std::exp2(std::max(0.0f, lambda - assets[i].wanted_lambda));
      }
      ASSERT_NEAR(error, best_error(assets, budget), 1e-9 * error);
    }
  }
}

TEST(PlanLevels, CoarsensWhatFewPixelsSeeFirst) {
  const std::vector<PlanAsset> assets = {asset_of({100, 10}, 0, 50), asset_of({100, 10}, 0, 1),
                                         asset_of({100, 10}, 0, 0)};
  EXPECT_EQ(plan_levels(assets, 230, 0)->finest, (std::vector<uint32_t>{0, 0, 1}));
  EXPECT_EQ(plan_levels(assets, 229, 0)->finest, (std::vector<uint32_t>{0, 1, 1}));
  EXPECT_EQ(plan_levels(assets, 129, 0)->finest, (std::vector<uint32_t>{1, 1, 1}));
}

TEST(PlanLevels, CoarsensTheLowestIndexOfEquals) {
  const std::vector<PlanAsset> assets(3, asset_of({100, 10}));
  EXPECT_EQ(plan_levels(assets, 329, 0)->finest, (std::vector<uint32_t>{1, 0, 0}));
}

TEST(PlanLevels, GivesUpALevelForItsBuildPeakAlone) {
  std::vector<PlanAsset> assets = {asset_of({10, 10}), asset_of({10, 10})};
  assets[1].build_peak_bytes = {1000, 5};
  const Result<Plan> plan = plan_levels(assets, 100, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->finest, (std::vector<uint32_t>{0, 1}));
  EXPECT_EQ(plan->build_peak_bytes, 5u);
}

TEST(PlanLevels, GetsPastLevelsThatTakeNothing) {
  const std::vector<PlanAsset> assets = {asset_of({0, 100, 10}), asset_of({0, 0, 0})};
  EXPECT_EQ(plan_levels(assets, 50, 0)->finest[0], 2u);
}

TEST(PlanLevels, BiasIsThePixelWeightedMeanOfLevelsGivenUp) {
  const std::vector<PlanAsset> assets = {asset_of({100, 50, 10}, 0.25f, 3.0), asset_of({1}, 0, 1.0)};
  const Result<Plan> plan = plan_levels(assets, 20, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->finest[0], 2u);
  EXPECT_NEAR(plan->bias, 3.0 * 1.75 / 4.0, 1e-6);
  const std::vector<PlanAsset> unseen = {asset_of({100, 10}, 0, 0.0)};
  EXPECT_EQ(plan_levels(unseen, 20, 0)->bias, 0.0);
}

TEST(PlanLevels, NoAssetsNeedOnlyTheFixedBytes) {
  EXPECT_TRUE(plan_levels({}, 100, 100));
  EXPECT_FALSE(plan_levels({}, 99, 100));
}

TEST(PlanLevels, DoesNotOverflowOnHugeSizes) {
  const uint64_t huge = kUnlimited / 2 + 5;
  const std::vector<PlanAsset> assets(4, asset_of({huge, huge, 7}));
  const Result<Plan> plan = plan_levels(assets, huge + 100, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->finest, (std::vector<uint32_t>{2, 2, 2, 1}));
  EXPECT_EQ(plan->resident_bytes, huge + 28);
  EXPECT_FALSE(plan_levels(assets, 1000, kUnlimited - 3));
}

TEST(PlanLevels, IsFastForManyAssets) {  // 1e5 assets, 1e6 steps: quadratic work would not end
  const std::vector<PlanAsset> assets(100000, asset_of({512, 256, 128, 64, 32, 16, 8, 4, 2, 1}));
  const Result<Plan> plan = plan_levels(assets, 100000, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->resident_bytes, 100000u);
}

TEST(PlanLevels, RefusesAssetsThatMakeNoSense) {
  const auto refuse = [](const PlanAsset& asset) {
    const Result<Plan> plan = plan_levels(std::span(&asset, 1), kUnlimited, 0);
    ASSERT_FALSE(plan);
    EXPECT_EQ(plan.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(plan.error().message.find("asset 0"), std::string::npos);
  };
  refuse(PlanAsset{});
  PlanAsset asset = asset_of({2, 1});
  asset.build_peak_bytes.pop_back();
  refuse(asset);
  asset = asset_of({2, 1});
  asset.lambda = {1.0f, 1.0f};
  refuse(asset);
  asset.lambda = {0.0f, kNan};
  refuse(asset);
  asset = asset_of({2, 1}, 0, -1.0);
  refuse(asset);
  refuse(asset_of({2, 1}, 0, kNan));
  refuse(asset_of({2, 1}, 0, kInf));
}

TEST(PlanLevels, SurvivesErrorsTooLargeForADouble) {
  PlanAsset asset = asset_of({3, 2, 1}, 0, 1e308);
  asset.lambda = {0.0f, 1e30f, 2e30f};
  const std::vector<PlanAsset> assets = {asset, asset_of({3, 2, 1}), asset};
  const Result<Plan> plan = plan_levels(assets, 3, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->finest, (std::vector<uint32_t>{2, 2, 2}));
}

}  // namespace
}  // namespace farfield
