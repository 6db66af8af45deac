// SPDX-License-Identifier: Apache-2.0
#include "bake_api/memory_guard.h"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

namespace farfield {
namespace {

constexpr uint64_t kMiB = 1 << 20;

/// Waits until the flag is set; false if that takes ten seconds.
bool becomes_true(const std::atomic<bool>& flag) {
  for (int i = 0; i < 1000 && !flag; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return flag;
}

TEST(MemoryGuard, WithoutALimitIsTheCallersFlag) {
  const std::atomic<bool> flag{false};
  EXPECT_EQ(MemoryGuard(0, &flag).cancel(), &flag);
  EXPECT_EQ(MemoryGuard(0, nullptr).cancel(), nullptr);
}

TEST(MemoryGuard, EndsWhatGrowsBeyondTheLimit) {
  const MemoryGuard guard(64 * kMiB, nullptr);
  std::vector<char> block(128 * kMiB, 1);
  EXPECT_TRUE(becomes_true(*guard.cancel()));
  EXPECT_GT(guard.exceeded_bytes(), 64 * kMiB);
  EXPECT_LT(guard.exceeded_bytes(), 256 * kMiB) << block[7];
}

TEST(MemoryGuard, LetsThroughWhatStaysBelow) {
  const MemoryGuard guard(256 * kMiB, nullptr);
  const std::vector<char> block(32 * kMiB, 1);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(*guard.cancel()) << block[7];
  EXPECT_EQ(guard.exceeded_bytes(), 0u);
}

TEST(MemoryGuard, HandsTheCallersFlagOn) {
  std::atomic<bool> flag{false};
  const MemoryGuard guard(1024 * kMiB, &flag);
  flag = true;
  EXPECT_TRUE(becomes_true(*guard.cancel()));
  EXPECT_EQ(guard.exceeded_bytes(), 0u);
}

}  // namespace
}  // namespace farfield
