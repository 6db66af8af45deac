// SPDX-License-Identifier: Apache-2.0
#include "bvh/level_choice.h"

#include <gtest/gtest.h>

#include <cmath>

namespace farfield {
namespace {

TracedAsset asset_with(std::vector<float> numbers) {
  TracedAsset asset;
  asset.base_resolution = 0.01f;
  asset.level_numbers = std::move(numbers);
  for (size_t slot = 0; slot < asset.level_numbers.size(); ++slot) {
    asset.usable_slots.push_back(static_cast<uint8_t>(slot));
  }
  return asset;
}

RayContext path(uint32_t seed) {
  RayContext ray;
  ray.path_seed = seed;
  return ray;
}

float chosen_lambda(const TracedAsset& asset, const InstanceFootprint& footprint, const RayContext& ray,
                    float t_entry) {
  return lambda_of_choice(asset, footprint, {}, choose_level(asset, footprint, {}, 1, ray, t_entry, {}), {});
}

/// How often paths see each slot at a lambda.
std::vector<double> shares(const TracedAsset& asset, float lambda, uint32_t instance = 5) {
  std::vector<double> counts(asset.slot_count(), 0.0);
  constexpr uint32_t kPaths = 20000;
  for (uint32_t seed = 0; seed < kPaths; ++seed) {
    counts[choose_level(asset, {}, {}, instance, path(seed), 0.0f, lambda).slot] += 1.0 / kPaths;
  }
  return counts;
}

TEST(LevelChoice, PathsSeeTheCoarserLevelWithTheProbabilityOfTheBlend) {
  const TracedAsset asset = asset_with({0, 1, 2, 3});
  for (const float lambda : {0.0f, 0.25f, 1.0f, 1.7f, 2.9f, 3.0f}) {
    const std::vector<double> share = shares(asset, lambda);
    for (uint32_t slot = 0; slot < 4; ++slot) {
      const double expected = std::max(0.0, 1.0 - std::abs(static_cast<double>(lambda) - slot));
      EXPECT_NEAR(share[slot], expected, 0.018) << "lambda " << lambda << " slot " << slot;  // 5 sigma
    }
  }
}

TEST(LevelChoice, FinerLevelServesAcrossAGapUntilTheLastOctave) {
  const TracedAsset asset = asset_with({0, 1, 5});
  for (const float lambda : {1.0f, 2.0f, 3.99f}) {
    const std::vector<double> share = shares(asset, lambda);
    EXPECT_NEAR(share[1], 1.0, 1e-9) << lambda;
  }
  const std::vector<double> share = shares(asset, 4.25f);
  EXPECT_EQ(share[0], 0.0);
  EXPECT_NEAR(share[1], 0.75, 0.018);
  EXPECT_NEAR(share[2], 0.25, 0.018);
}

TEST(LevelChoice, LevelsThatThePlanLeavesOutAreAsIfNotStored) {
  TracedAsset asset = asset_with({0, 1, 2, 3, 4, 5});
  asset.usable_slots = {1, 5};
  EXPECT_NEAR(shares(asset, 3.99f)[1], 1.0, 1e-9);
  const std::vector<double> share = shares(asset, 4.25f);
  EXPECT_NEAR(share[1], 0.75, 0.018);
  EXPECT_NEAR(share[5], 0.25, 0.018);
  RayContext ray = path(1);
  HitRecord hit;
  hit.instance = 7;
  hit.level_slot = 3;  // of an earlier plan
  ray.set_origin(hit);
  EXPECT_EQ(choose_level(asset, {}, {}, 7, ray, 0.0f, 1.0f).slot, 5u);
}

TEST(LevelChoice, TheSamePathNeverGoesBackToAFinerLevelAsLambdaGrows) {
  const TracedAsset asset = asset_with({0, 1, 2, 4, 5});
  for (uint32_t seed = 0; seed < 200; ++seed) {
    uint32_t last = 0;
    for (float lambda = 0.0f; lambda <= 6.0f; lambda += 0.01f) {
      const uint32_t slot = choose_level(asset, {}, {}, 3, path(seed), 0.0f, lambda).slot;
      EXPECT_GE(slot, last);
      EXPECT_LE(slot, last + 1);
      last = slot;
    }
  }
}

TEST(LevelChoice, JustBelowAndJustAboveAnIntegerAlmostAllPathsSeeTheSame) {
  const TracedAsset asset = asset_with({0, 1, 2, 3});
  int different = 0;
  for (uint32_t seed = 0; seed < 20000; ++seed) {
    different += choose_level(asset, {}, {}, 1, path(seed), 0.0f, 2.0f - 1e-4f).slot !=
                 choose_level(asset, {}, {}, 1, path(seed), 0.0f, 2.0f + 1e-4f).slot;
  }
  EXPECT_LE(different, 20);  // expected 4
}

TEST(LevelChoice, PathAndInstanceDecideAndNothingElse) {
  const TracedAsset asset = asset_with({0, 1});
  RayContext a = path(7);
  RayContext b = path(7);
  b.ray_seed = 99;
  b.hit.level_slot = 1;
  int between_instances = 0;
  for (uint32_t instance = 0; instance < 1000; ++instance) {
    const uint32_t slot = choose_level(asset, {}, {}, instance, a, 0.0f, 0.5f).slot;
    EXPECT_EQ(slot, choose_level(asset, {}, {}, instance, b, 3.0f, 0.5f).slot);
    between_instances += static_cast<int>(slot);
  }
  EXPECT_NEAR(between_instances, 500, 80);  // 5 sigma: instances are independent
}

TEST(LevelChoice, ThePlanClampsLambda) {
  TracedAsset asset = asset_with({0, 1, 2, 3});
  asset.usable_slots = {2, 3};
  for (const float lambda : {0.0f, 0.7f, 1.99f, 2.0f}) {
    const LevelChoice choice = choose_level(asset, {}, {}, 1, path(1), 0.0f, lambda);
    EXPECT_EQ(choice.slot, 2u);
    EXPECT_EQ(lambda_of_choice(asset, {}, {}, choice, lambda), 2.0f);
  }
}

TEST(LevelChoice, TakesTheWiderOfCameraAndCone) {
  const TracedAsset asset = asset_with({0, 1, 2, 3, 4, 5, 6, 7});
  const InstanceFootprint camera{0.04f, 1.0f};  // lambda 2
  RayContext ray = path(1);
  EXPECT_NEAR(chosen_lambda(asset, camera, ray, 100.0f), 2.0f, 1e-4f);
  ray.cone_spread = 0.0016f;  // 0.16 at t = 100: lambda 4
  EXPECT_NEAR(chosen_lambda(asset, camera, ray, 100.0f), 4.0f, 1e-4f);
  EXPECT_NEAR(chosen_lambda(asset, camera, ray, 1.0f), 2.0f, 1e-4f);
  ray.cone_width = 0.32f;
  EXPECT_NEAR(chosen_lambda(asset, camera, ray, 0.0f), 5.0f, 1e-4f);
  // An instance twice as large needs one level finer; pixel_error 4 makes it two levels coarser.
  EXPECT_NEAR(chosen_lambda(asset, {0.04f, 0.5f}, path(1), 0.0f), 1.0f, 1e-4f);
  EXPECT_NEAR(chosen_lambda(asset, {0.04f, 4.0f}, path(1), 0.0f), 4.0f, 1e-4f);
}

// What footprints see is what the lambda of theirs sees.
TEST(LevelChoice, FootprintsAndLambdasChooseTheSame) {
  TracedAsset asset = asset_with({0, 1, 2, 3, 5, 8});
  for (const std::vector<uint8_t>& usable : {std::vector<uint8_t>{0, 1, 2, 3, 4, 5}, {1, 3, 5}, {2, 5}, {5}}) {
    asset.usable_slots = usable;
    for (int i = -20; i <= 200; ++i) {
      const float footprint = asset.base_resolution * std::exp2(static_cast<float>(i) / 20);
      const float lambda = std::clamp(static_cast<float>(i) / 20, 0.0f, 8.0f);
      int different = 0;
      for (uint32_t seed = 0; seed < 100; ++seed) {
        different += choose_level(asset, {footprint, 1.0f}, {}, 3, path(seed), 0.0f, {}).slot !=
                     choose_level(asset, {footprint, 1.0f}, {}, 3, path(seed), 0.0f, lambda).slot;
      }
      EXPECT_LE(different, 1) << lambda;  // exp2 rounds
    }
  }
}

TEST(LevelChoice, RaysThatLeaveAHitKeepItsLevelOnThatInstanceOnly) {
  TracedAsset asset = asset_with({0, 1, 2, 3});
  asset.usable_slots = {1, 2, 3};
  HitRecord hit;
  hit.instance = 4;
  hit.level_slot = 1;
  RayContext ray = path(1);
  ray.cone_width = 1e6f;
  ray.set_origin(hit);
  EXPECT_EQ(choose_level(asset, {0.0f, 1.0f}, {}, 4, ray, 1.0f, std::nullopt).slot, 1u);
  EXPECT_EQ(choose_level(asset, {0.0f, 1.0f}, {}, 5, ray, 1.0f, std::nullopt).slot, 3u);
  ray.origin_level_slot = 200;  // a stale record is clamped, not trusted
  EXPECT_EQ(choose_level(asset, {0.0f, 1.0f}, {}, 4, ray, 1.0f, std::nullopt).slot, 3u);
  ray.origin_level_slot = 0;
  EXPECT_EQ(choose_level(asset, {0.0f, 1.0f}, {}, 4, ray, 1.0f, std::nullopt).slot, 1u);
}

TEST(LevelChoice, ExtremeFootprintsGiveTheEnds) {
  const TracedAsset asset = asset_with({0, 1, 2, 3});
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(choose_level(asset, {0.0f, 1.0f}, {}, 1, path(1), 0.0f, std::nullopt).slot, 0u);
  EXPECT_EQ(choose_level(asset, {inf, 1.0f}, {}, 1, path(1), 0.0f, std::nullopt).slot, 3u);
  EXPECT_LE(choose_level(asset, {nan, 1.0f}, {}, 1, path(1), 0.0f, std::nullopt).slot, 3u);
  RayContext ray = path(1);
  ray.cone_spread = inf;
  EXPECT_LE(choose_level(asset, {1.0f, 1.0f}, {}, 1, ray, 0.0f, std::nullopt).slot, 3u);
  const TracedAsset root_only = asset_with({6});
  EXPECT_EQ(choose_level(root_only, {0.0f, 1.0f}, {}, 1, path(1), 0.0f, std::nullopt).slot, 0u);
}

}  // namespace
}  // namespace farfield
