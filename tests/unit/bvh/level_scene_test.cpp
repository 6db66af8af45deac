// SPDX-License-Identifier: Apache-2.0
#include "bvh/level_scene.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>
#include <vector>

#include "base/parallel.h"
#include "tests/support/level_builder.h"

namespace farfield {
namespace {

using test::triangle_soup;

TEST(LevelScene, TakesTheSameBytesEveryTimeAndGivesThemAllBack) {
  auto device = BvhDevice::create();
  ASSERT_TRUE(device) << device.error().message;
  const LevelData soup = triangle_soup(20000, 0.02f, 1);
  const uint64_t before = (*device)->bytes();
  uint64_t bytes = 0;
  for (int i = 0; i < 3; ++i) {
    const auto scene = LevelScene::build(**device, view_of(soup));
    ASSERT_TRUE(scene);
    if (i == 0) bytes = scene->bytes();
    EXPECT_EQ(scene->bytes(), bytes);
    EXPECT_EQ((*device)->bytes() - before, scene->bytes() - kSceneOverheadBytes - kGeometryOverheadBytes);
    EXPECT_GT(scene->build_peak_bytes(), 0u);
  }
  EXPECT_EQ((*device)->bytes(), before);
  EXPECT_GT(bytes, 20000u * 30);
  EXPECT_LT(bytes, 20000u * 150);
}

TEST(LevelScene, CostIsTheSameWhateverElseIsLoaded) {
  const LevelData soup = triangle_soup(5000, 0.02f, 2);
  const LevelData other = triangle_soup(3000, 0.02f, 3);
  const auto alone = measure_level_scene(view_of(soup));
  ASSERT_TRUE(alone);
  auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  const auto resident = LevelScene::build(**device, view_of(other));
  const auto beside = measure_level_scene(**device, view_of(soup));
  ASSERT_TRUE(beside);
  EXPECT_EQ(alone->resident_bytes, beside->resident_bytes);
  EXPECT_EQ(alone->build_peak_bytes, beside->build_peak_bytes);
}

TEST(LevelScene, BuildsOfSeveralThreadsAreToldApart) {
  const std::array soups = {triangle_soup(30000, 0.02f, 2), triangle_soup(5000, 0.02f, 3)};
  const std::array alone = {measure_level_scene(view_of(soups[0])), measure_level_scene(view_of(soups[1]))};
  ASSERT_TRUE(alone[0] && alone[1]);
  auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  const uint64_t before = (*device)->bytes();
  std::vector<std::thread> threads;
  for (size_t i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      for (int repeat = 0; repeat < 5; ++repeat) {
        const auto cost = measure_level_scene(**device, view_of(soups[i % 2]));
        ASSERT_TRUE(cost);
        EXPECT_EQ(cost->resident_bytes, alone[i % 2]->resident_bytes);
        EXPECT_EQ(cost->build_peak_bytes, alone[i % 2]->build_peak_bytes);
        // One that may not take so much fails alone.
        const uint64_t enough = cost->resident_bytes + cost->build_peak_bytes;
        const auto refused = LevelScene::build(**device, view_of(soups[i % 2]), {enough / 2});
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::OutOfBudget);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ((*device)->bytes(), before);
}

TEST(LevelScene, ABuildThatWouldTakeMoreThanItMayStopsThereAndIsForgotten) {
  const LevelData soup = triangle_soup(30000, 0.02f, 2), other = triangle_soup(3000, 0.02f, 3);
  const auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  BvhDevice& d = **device;
  const auto beside = LevelScene::build(d, view_of(other));
  const auto whole = measure_level_scene(d, view_of(soup));
  ASSERT_TRUE(beside && whole);
  const uint64_t before = d.bytes();
  const auto free = LevelScene::build(d, view_of(soup));
  ASSERT_TRUE(free);
  const uint64_t enough = free->bytes() + free->build_peak_bytes();
  for (const double share : {0.0, 0.01, 0.3, 0.6, 0.9, 0.99}) {
    const uint64_t held = d.bytes();
    const auto most = static_cast<uint64_t>(share * static_cast<double>(enough));
    const auto scene = LevelScene::build(d, view_of(soup), {most});
    ASSERT_FALSE(scene) << share;
    EXPECT_EQ(scene.error().code, ErrorCode::OutOfBudget);
    EXPECT_EQ(d.bytes(), held) << share;  // nothing is left of it, in Embree's sum or in ours
  }
  const auto again = LevelScene::build(d, view_of(soup), {enough});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->bytes(), free->bytes());
  EXPECT_GT(d.bytes(), before);
}

TEST(LevelScene, ABuildCanBeCancelledAndIsForgotten) {
  const LevelData soup = triangle_soup(300000, 0.005f, 2);
  const auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  const auto once = LevelScene::build(**device, view_of(soup));
  ASSERT_TRUE(once);
  const uint64_t before = (*device)->bytes();
  std::atomic<bool> cancel{true};
  const auto never = LevelScene::build(**device, view_of(soup), {kAnyBytes, &cancel});
  ASSERT_FALSE(never);
  EXPECT_EQ(never.error().code, ErrorCode::Cancelled);
  EXPECT_EQ((*device)->bytes(), before);
  cancel = false;
  const auto again = LevelScene::build(**device, view_of(soup), {kAnyBytes, &cancel});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->bytes(), once->bytes());
}

TEST(LevelScene, CostDoesNotDependOnTheNumberOfThreads) {
  const LevelData soup = triangle_soup(30000, 0.02f, 4);
  const auto many = measure_level_scene(view_of(soup));
  const ThreadLimit limit(1);
  const auto one = measure_level_scene(view_of(soup));
  ASSERT_TRUE(many && one);
  EXPECT_EQ(many->resident_bytes, one->resident_bytes);
  EXPECT_EQ(many->build_peak_bytes, one->build_peak_bytes);
}

TEST(LevelScene, OurDeviceKeepsTheThreadLimitThatItFinds) {
  const ThreadLimit limit(1);
  ASSERT_EQ(thread_count(), 1);
  const auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  EXPECT_EQ(thread_count(), 1);
}

TEST(LevelScene, ALevelWithoutSurfaceHasNoScene) {
  auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  LevelData level = test::empty_level(3, 1.0f);
  const auto nothing = LevelScene::build(**device, view_of(level));
  ASSERT_TRUE(nothing);
  EXPECT_EQ(nothing->handle(), nullptr);
  EXPECT_EQ(nothing->bytes(), 0u);
  test::set_volume(level, {1, 1, 1}, vec3(0.0f), [](int, int, int) { return 1.0f; });
  const auto cost = measure_level_scene(**device, view_of(level));
  ASSERT_TRUE(cost);
  EXPECT_GE(cost->resident_bytes, sizeof(Brick) + sizeof(uint32_t));
  EXPECT_EQ(cost->build_peak_bytes, 0u);
}

TEST(LevelScene, DegenerateQuadsAreNoError) {
  auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  LevelData level = test::empty_level(0, 1.0f);
  test::set_triangles(level, {vec3(0.0f), vec3(1.0f), vec3(1.0f)}, {{0, 0, 0}, {1, 2, 1}, {0, 1, 2}});
  const auto scene = LevelScene::build(**device, view_of(level));
  ASSERT_TRUE(scene);
  EXPECT_NE(scene->handle(), nullptr);
}

}  // namespace
}  // namespace farfield
