// SPDX-License-Identifier: Apache-2.0
#include "lodselect/planner.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "base/nonfinite.h"
#include "base/random.h"

namespace farfield {
namespace {

constexpr uint64_t kUnlimited = std::numeric_limits<uint64_t>::max();

/// Levels 0, 1, 2, ... of the given sizes, of which one instance asks.
PlanAsset asset_of(std::vector<uint64_t> sizes, float wanted = 0, double pixels = 1) {
  PlanAsset asset;
  asset.build_peak_bytes.assign(sizes.size(), 0);
  for (size_t i = 0; i < sizes.size(); ++i) asset.lambda.push_back(static_cast<float>(i));
  asset.resident_bytes = std::move(sizes);
  asset.ask(wanted, pixels);
  return asset;
}

/// An asset with what its instances ask, from which ask() makes sums.
struct Asked {
  PlanAsset asset;
  std::vector<std::pair<float, double>> instances;  // lambda, pixels
};

Asked random_asset(Rng& rng) {
  Asked asked;
  PlanAsset& asset = asked.asset;
  const size_t levels = 1 + rng.next_uint() % 9;
  float lambda = 0;
  for (size_t i = 0; i < levels; ++i) {
    // Mostly shrinking by 3, sometimes not at all; sizes and peaks of 0 happen.
    const double size = 1e6 * std::pow(3.0, -static_cast<double>(i)) * rng.next();
    asset.resident_bytes.push_back(rng.next_uint() % 8 == 0 ? 0 : static_cast<uint64_t>(size));
    asset.build_peak_bytes.push_back(static_cast<uint64_t>(0.3 * size * rng.next()));
    asset.lambda.push_back(lambda);
    asset.ray_cost.push_back(rng.next_uint() % 6 == 0 ? 0.0f : 100.0f + 100.0f * rng.next());
    lambda += rng.next_uint() % 4 == 0 ? 2.0f : 1.0f;
  }
  for (uint32_t i = rng.next_uint() % 4; i > 0; --i) {
    const double pixels = rng.next_uint() % 6 == 0 ? 0.0 : 1000.0 * rng.next();
    asked.instances.emplace_back(12.0f * rng.next() - 2.0f, pixels);
    asset.ask(asked.instances.back().first, pixels);
  }
  return asked;
}

std::vector<Asked> random_scene(uint64_t seed) {
  Rng rng(seed);
  std::vector<Asked> scene(1 + rng.next_uint() % 12);
  for (Asked& asked : scene) asked = random_asset(rng);
  return scene;
}

std::vector<PlanAsset> assets_of(const std::vector<Asked>& scene) {
  std::vector<PlanAsset> assets;
  for (const Asked& asked : scene) assets.push_back(asked.asset);
  return assets;
}

/// Sum over instances of pixels * 2^(levels too coarse), by each instance alone.
double error_by_instance(const std::vector<Asked>& scene, const Plan& plan) {
  double error = 0, pixels = 0;
  for (size_t i = 0; i < scene.size(); ++i) {
    const std::vector<float>& lambda = scene[i].asset.lambda;
    for (const auto& [wanted, weight] : scene[i].instances) {
      const float asked = std::clamp(wanted, lambda.front(), lambda.back());
      error += weight * std::exp2(std::max(0.0f, lambda[plan.finest(i)] - asked));
      pixels += weight;
    }
  }
  return pixels > 0 ? error / pixels : 1;
}

std::vector<uint32_t> finest_of(const Plan& plan) {
  std::vector<uint32_t> finest;
  for (size_t i = 0; i < plan.usable.size(); ++i) finest.push_back(plan.finest(i));
  return finest;
}

uint64_t resident_bytes_of(std::span<const PlanAsset> assets, const Plan& plan) {
  uint64_t sum = 0;
  for (size_t i = 0; i < assets.size(); ++i) {
    for (const uint8_t level : plan.usable[i]) sum += assets[i].resident_bytes[level];
  }
  return sum;
}

uint64_t peak_bytes_of(std::span<const PlanAsset> assets, const Plan& plan) {
  uint64_t peak = 0;
  for (size_t i = 0; i < assets.size(); ++i) {
    for (const uint8_t level : plan.usable[i]) peak = std::max(peak, assets[i].build_peak_bytes[level]);
  }
  return peak;
}

/// The plan of roots alone.
Plan roots_of(std::span<const PlanAsset> assets) {
  Plan plan;
  for (const PlanAsset& asset : assets) plan.usable.push_back({static_cast<uint8_t>(asset.lambda.size() - 1)});
  return plan;
}

TEST(PlanLevels, MoreBudgetNeverGivesALargerErrorAndEnoughGivesNone) {
  for (uint64_t seed = 0; seed < 300; ++seed) {
    const std::vector<PlanAsset> assets = assets_of(random_scene(seed));
    const uint64_t most = plan_levels(assets, kUnlimited, 777)->asked_bytes;
    double previous = std::numeric_limits<double>::infinity();
    for (uint64_t budget = 0; budget < most; budget += most / 97 + 1) {
      const Result<Plan> plan = plan_levels(assets, budget, 777);
      if (!plan) continue;
      ASSERT_LE(plan->error, previous * (1 + 1e-12)) << "seed " << seed;
      previous = plan->error;
    }
    const Result<Plan> plan = plan_levels(assets, most, 777);
    ASSERT_TRUE(plan);
    EXPECT_NEAR(plan->error, 1.0, 1e-9);
    EXPECT_NEAR(plan->bias, 0.0, 1e-6);
    EXPECT_LE(plan->error, previous * (1 + 1e-12));
  }
}

TEST(PlanLevels, FitsAndCountsWhatItAllows) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const std::vector<Asked> scene = random_scene(seed);
    const std::vector<PlanAsset> assets = assets_of(scene);
    const uint64_t most = plan_levels(assets, kUnlimited, 0)->resident_bytes;
    for (uint64_t part = 1; part <= 8; ++part) {
      const uint64_t budget = most * part / 8 + 500;
      const Result<Plan> plan = plan_levels(assets, budget, 500);
      if (!plan) continue;
      EXPECT_EQ(plan->resident_bytes, resident_bytes_of(assets, *plan));
      EXPECT_EQ(plan->build_peak_bytes, peak_bytes_of(assets, *plan));
      EXPECT_LE(plan->resident_bytes + plan->build_peak_bytes + 500, budget);
      EXPECT_NEAR(error_by_instance(scene, *plan), plan->error, 1e-5 * plan->error);
      for (size_t i = 0; i < assets.size(); ++i) {
        EXPECT_TRUE(std::ranges::is_sorted(plan->usable[i], std::less_equal<>()) || plan->usable[i].size() == 1);
        EXPECT_EQ(plan->usable[i].back(), assets[i].lambda.size() - 1);
      }
    }
  }
}

TEST(PlanLevels, LeavesNoRoomInWhichAnAssetCouldBeFiner) {
  // Two steps of one price: after the large one does not fit, the small one must still be taken.
  const std::vector<PlanAsset> assets = {asset_of({1000, 10}, 0, 100), asset_of({50, 10}, 0, 1)};
  EXPECT_EQ(finest_of(*plan_levels(assets, 500, 0)), (std::vector<uint32_t>{1, 0}));
}

/// 1234 in "... need 1.21 KiB (1234 bytes); ...".
uint64_t bytes_in_last_bracket(const std::string& message) {
  return std::stoull(message.substr(message.rfind('(') + 1));
}

TEST(PlanLevels, NumberInTheErrorIsTheSmallestBudgetThatWorks) {
  for (uint64_t seed = 0; seed < 100; ++seed) {
    const std::vector<PlanAsset> assets = assets_of(random_scene(seed));
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
  const std::vector<float> wanted = {-3.0f, 0.0f, 0.99f, 1.0f, 2.5f, 4.0f, 100.0f, kInfinity, -kInfinity, kNan};
  const std::vector<uint32_t> expected = {0, 0, 0, 1, 2, 4, 4, 4, 0, 0};
  std::vector<PlanAsset> assets;
  for (const float lambda : wanted) assets.push_back(asset_of({50, 40, 30, 20, 10}, lambda));
  const Result<Plan> plan = plan_levels(assets, kUnlimited, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(finest_of(*plan), expected);
  EXPECT_EQ(plan->bias, 0.0);
  EXPECT_EQ(plan->error, 1.0);
}

TEST(PlanLevels, TakesTheNextFinerLevelWhereOneIsSkipped) {
  PlanAsset asset = asset_of({50, 40, 10}, 10);
  asset.lambda = {0.0f, 1.0f, 4.0f};
  asset.demand.clear();
  asset.ask(3.9f, 1);
  EXPECT_EQ(plan_levels(std::span(&asset, 1), kUnlimited, 0)->finest(0), 1u);
}

/// Smallest error of all plans that fit, each asset with a finest level and its root.
double best_error(const std::vector<Asked>& scene, const std::vector<PlanAsset>& assets, uint64_t budget) {
  Plan plan = roots_of(assets);
  double best = std::numeric_limits<double>::infinity();
  for (;;) {
    if (resident_bytes_of(assets, plan) + peak_bytes_of(assets, plan) <= budget) {
      best = std::min(best, error_by_instance(scene, plan));
    }
    size_t i = 0;
    for (; i < assets.size(); ++i) {
      const uint8_t finest = plan.finest(i), root = plan.usable[i].back();
      plan.usable[i] = {root};
      if (finest == 0) continue;  // all tried: from the root again, and on with the next asset
      plan.usable[i].insert(plan.usable[i].begin(), static_cast<uint8_t>(finest - 1));
      break;
    }
    if (i == assets.size()) return best;
  }
}

TEST(PlanLevels, IsNearTheBestThereIs) {
  // A greedy knapsack misses at most the gain of one step; measured over these scenes.
  double worst = 1, sum = 0;
  int plans = 0;
  for (uint64_t seed = 0; seed < 60; ++seed) {
    std::vector<Asked> scene = random_scene(seed);
    scene.resize(std::min<size_t>(scene.size(), 4));
    const std::vector<PlanAsset> assets = assets_of(scene);
    const uint64_t most = plan_levels(assets, kUnlimited, 0)->asked_bytes;
    for (uint64_t part = 1; part < 8; ++part) {
      const Result<Plan> plan = plan_levels(assets, most * part / 8, 0);
      if (!plan) continue;
      const double ratio = plan->error / best_error(scene, assets, most * part / 8);
      EXPECT_GE(ratio, 1 - 1e-5);
      worst = std::max(worst, ratio);
      sum += ratio, ++plans;
    }
  }
  EXPECT_LE(sum / plans, 1.5) << "worst " << worst;
}

TEST(PlanLevels, GivesFewerPixelsTheCoarserLevel) {
  const std::vector<PlanAsset> assets = {asset_of({100, 10}, 0, 50), asset_of({100, 10}, 0, 1),
                                         asset_of({100, 10}, 0, 0)};
  EXPECT_EQ(finest_of(*plan_levels(assets, 230, 0)), (std::vector<uint32_t>{0, 0, 1}));
  EXPECT_EQ(finest_of(*plan_levels(assets, 229, 0)), (std::vector<uint32_t>{0, 1, 1}));
  EXPECT_EQ(finest_of(*plan_levels(assets, 129, 0)), (std::vector<uint32_t>{1, 1, 1}));
}

TEST(PlanLevels, RefinesTheLowestIndexOfEquals) {
  const std::vector<PlanAsset> assets(3, asset_of({100, 10}));
  EXPECT_EQ(finest_of(*plan_levels(assets, 229, 0)), (std::vector<uint32_t>{0, 1, 1}));
}

TEST(PlanLevels, GivesUpALevelForItsBuildPeakAlone) {
  std::vector<PlanAsset> assets = {asset_of({10, 10}), asset_of({10, 10})};
  assets[1].build_peak_bytes = {1000, 5};
  const Result<Plan> plan = plan_levels(assets, 100, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(finest_of(*plan), (std::vector<uint32_t>{0, 1}));
  EXPECT_EQ(plan->build_peak_bytes, 5u);
}

TEST(PlanLevels, GetsPastLevelsThatTakeNothing) {
  const std::vector<PlanAsset> assets = {asset_of({100, 0, 10}), asset_of({0, 0, 0})};
  EXPECT_EQ(finest_of(*plan_levels(assets, 50, 0)), (std::vector<uint32_t>{1, 0}));
}

TEST(PlanLevels, BiasIsThePixelWeightedMeanOfLevelsGivenUp) {
  const std::vector<PlanAsset> assets = {asset_of({100, 50, 10}, 0.25f, 3.0), asset_of({1}, 0, 1.0)};
  const Result<Plan> plan = plan_levels(assets, 20, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->finest(0), 2u);
  EXPECT_NEAR(plan->bias, 3.0 * 1.75 / 4.0, 1e-6);
  EXPECT_NEAR(plan->levels_given_up[0], 1.75f, 1e-6f);
  EXPECT_EQ(plan->levels_given_up[1], 0.0f);
  EXPECT_EQ(plan->asked_bytes, 111u);  // what is asked and the roots
  const std::vector<PlanAsset> unseen = {asset_of({100, 10}, 0, 0.0)};
  EXPECT_EQ(plan_levels(unseen, 20, 0)->bias, 0.0);
}

/// Levels of which instances ask for 0, 2 and the root.
PlanAsset asset_with_costs(std::vector<float> costs) {
  PlanAsset asset = asset_of({1000, 300, 100, 30, 10});
  asset.ask(2.0f, 5);
  asset.ask(4.0f, 5);
  asset.ray_cost = std::move(costs);
  return asset;
}

std::vector<uint8_t> usable(const PlanAsset& asset, uint64_t budget) {
  return plan_levels(std::span(&asset, 1), budget, 0)->usable[0];
}

TEST(PlanLevels, AllowsOnlyWhatSomebodyAsksFor) {
  const PlanAsset asset = asset_with_costs({50, 40, 30, 20, 10});
  EXPECT_EQ(usable(asset, kUnlimited), (std::vector<uint8_t>{0, 2, 4}));
  EXPECT_EQ(usable(asset_with_costs({}), kUnlimited), (std::vector<uint8_t>{0, 2, 4}));
  PlanAsset between = asset;
  between.ask(2.5f, 1);  // sees level 3, too
  EXPECT_EQ(usable(between, kUnlimited), (std::vector<uint8_t>{0, 2, 3, 4}));
  PlanAsset nobody = asset;
  nobody.demand.clear();
  EXPECT_EQ(usable(nobody, kUnlimited), (std::vector<uint8_t>{4}));
}

TEST(PlanLevels, LeavesOutWhatIsDearerThanAFinerLevel) {
  // Who asks for level 2 is served by level 1, and by the source where that is dearer, too.
  EXPECT_EQ(usable(asset_with_costs({50, 40, 60, 20, 10}), kUnlimited), (std::vector<uint8_t>{0, 1, 4}));
  EXPECT_EQ(usable(asset_with_costs({50, 51, 60, 20, 10}), kUnlimited), (std::vector<uint8_t>{0, 4}));
  EXPECT_EQ(usable(asset_with_costs({50, 90, 40, 20, 10}), kUnlimited), (std::vector<uint8_t>{0, 2, 4}));
}

TEST(PlanLevels, TakesACheaperFinerLevelOnlyWhereThereIsRoom) {
  PlanAsset asset = asset_of({1000, 300, 100, 10}, 2.0f);
  asset.ray_cost = {50, 90, 60, 10};  // not by a fifth
  EXPECT_EQ(usable(asset, kUnlimited), (std::vector<uint8_t>{2, 3}));
  asset.ray_cost = {50, 90, 70, 10};
  EXPECT_EQ(usable(asset, 1010), (std::vector<uint8_t>{0, 3}));
  EXPECT_EQ(usable(asset, 1009), (std::vector<uint8_t>{2, 3}));
  EXPECT_EQ(plan_levels(std::span(&asset, 1), 1009, 0)->asked_bytes, 110u);
  EXPECT_EQ(usable(asset, 109), (std::vector<uint8_t>{3}));
}

TEST(PlanLevels, GivesUpSpeedBeforeError) {
  const PlanAsset asset = asset_with_costs({50, 40, 30, 20, 10});
  EXPECT_EQ(usable(asset, 1110), (std::vector<uint8_t>{0, 2, 4}));
  EXPECT_EQ(usable(asset, 1109), (std::vector<uint8_t>{0, 4}));
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
  EXPECT_EQ(finest_of(*plan), (std::vector<uint32_t>{0, 2, 2, 2}));
  EXPECT_EQ(plan->resident_bytes, huge + 28);
  EXPECT_FALSE(plan_levels(assets, 1000, kUnlimited - 3));
}

TEST(PlanLevels, IsFastForManyAssets) {  // 1e5 assets, 1e6 steps: quadratic work would not end
  const std::vector<PlanAsset> assets(100000, asset_of({512, 256, 128, 64, 32, 16, 8, 4, 2, 1}));
  const Result<Plan> plan = plan_levels(assets, 1000000, 0);
  ASSERT_TRUE(plan);
  EXPECT_LE(plan->resident_bytes, 1000000u);
  EXPECT_GE(plan->resident_bytes, 999000u);
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
  asset = asset_of({2, 1});
  asset.ray_cost = {1.0f};
  refuse(asset);
  refuse(asset_of(std::vector<uint64_t>(257, 1)));
  refuse(asset_of({2, 1}, 0, kNan));
  refuse(asset_of({2, 1}, 0, kInfinity));
}

TEST(PlanLevels, SurvivesErrorsTooLargeForADouble) {
  PlanAsset asset = asset_of({3, 2, 1}, 0, 1e308);
  asset.lambda = {0.0f, 1e30f, 2e30f};
  const std::vector<PlanAsset> assets = {asset, asset_of({3, 2, 1}), asset};
  const Result<Plan> plan = plan_levels(assets, 3, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(finest_of(*plan), (std::vector<uint32_t>{2, 2, 2}));
}

/// The same with morphs of these sizes; the last level has none.
PlanAsset morphing(PlanAsset asset, const std::vector<uint64_t>& sizes, uint64_t peak = 0) {
  for (const uint64_t size : sizes) asset.morphs.push_back(MorphSize{size, peak});
  asset.morphs.emplace_back();
  return asset;
}

TEST(Morphs, TakeTheRoomThatIsLeftWhereInstancesSeeABlend) {
  PlanAsset asset = morphing(asset_of({1000, 100, 10}, 0.5f), {500, 50});
  const auto plan = plan_levels({&asset, 1}, kUnlimited, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->usable, (std::vector<std::vector<uint8_t>>{{0, 1, 2}}));
  EXPECT_EQ(plan->morphs, (std::vector<std::vector<uint8_t>>{{0}}));  // nobody is between 1 and 2
  EXPECT_EQ(plan->resident_bytes, 1610u);
  EXPECT_EQ(plan->morphs_given_up, 0u);
}

TEST(Morphs, AreGivenUpBeforeLevels) {
  PlanAsset asset = morphing(asset_of({1000, 100, 10}, 0.5f), {500, 50}, 40);
  for (const uint64_t budget : {1110ul, 1649ul}) {
    const auto plan = plan_levels({&asset, 1}, budget, 0);
    ASSERT_TRUE(plan);
    EXPECT_EQ(plan->finest(0), 0);
    EXPECT_TRUE(plan->morphs[0].empty()) << budget;
    EXPECT_EQ(plan->morphs_given_up, 1u) << budget;
  }
  const auto plan = plan_levels({&asset, 1}, 1650, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->morphs[0].size(), 1u);
  EXPECT_EQ(plan->resident_bytes + plan->build_peak_bytes, 1650u);
}

TEST(Morphs, AreBetweenNeighboursOnly) {
  PlanAsset asset = morphing(asset_of({1000, 900, 10}, 0.5f), {1, 1});
  asset.ray_cost = {10, 11, 5};  // the middle level costs rays more than the finest: it is left out
  const auto plan = plan_levels({&asset, 1}, kUnlimited, 0);
  ASSERT_TRUE(plan);
  ASSERT_EQ(plan->usable, (std::vector<std::vector<uint8_t>>{{0, 2}}));
  EXPECT_TRUE(plan->morphs[0].empty());
}

TEST(Morphs, NeverPassTheBudget) {
  Rng rng(5);
  for (int round = 0; round < 300; ++round) {
    std::vector<PlanAsset> assets;
    for (uint32_t i = 0; i < 1 + rng.next_uint() % 5; ++i) {
      Asked asked = random_asset(rng);
      std::vector<uint64_t> sizes;
      for (size_t k = 1; k < asked.asset.lambda.size(); ++k) sizes.push_back(static_cast<uint64_t>(1e6 * rng.next()));
      assets.push_back(morphing(std::move(asked.asset), sizes, static_cast<uint64_t>(1e6 * rng.next())));
    }
    const auto budget = static_cast<uint64_t>(5e6 * rng.next());
    const auto plan = plan_levels(assets, budget, 1000);
    if (!plan) continue;
    EXPECT_LE(plan->resident_bytes + plan->build_peak_bytes + 1000, budget);
    for (size_t i = 0; i < assets.size(); ++i) {
      for (const uint8_t level : plan->morphs[i]) {
        EXPECT_TRUE(std::ranges::count(plan->usable[i], level) && std::ranges::count(plan->usable[i], level + 1));
      }
    }
  }
}

}  // namespace
}  // namespace farfield
