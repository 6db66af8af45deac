// SPDX-License-Identifier: Apache-2.0
#include "base/process_memory.h"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <cstring>

namespace farfield {
namespace {

constexpr size_t kBlock = 64 << 20;
constexpr double kSlack = 2 << 20;  ///< of other things in the process, and of the kernel's batched counters

void* touch_block() {
  void* block = mmap(nullptr, kBlock, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  std::memset(block, 1, kBlock);
  return block;
}

TEST(ProcessMemory, GrowsAndShrinksWithWhatIsTouched) {
  const auto before = static_cast<double>(resident_set_bytes());
  ASSERT_GT(before, 0);
  void* block = touch_block();
  EXPECT_NEAR(static_cast<double>(resident_set_bytes()) - before, kBlock, kSlack);
  munmap(block, kBlock);
  EXPECT_NEAR(static_cast<double>(resident_set_bytes()) - before, 0, kSlack);
}

TEST(PeakMemory, RemembersWhatWasGivenBackAndForgetsWhatWasBefore) {
  munmap(touch_block(), kBlock);
  const auto before = static_cast<double>(resident_set_bytes());
  const PeakMemory memory;
  EXPECT_NEAR(static_cast<double>(memory.peak_bytes()) - before, 0, kSlack);
  munmap(touch_block(), kBlock);
  EXPECT_NEAR(static_cast<double>(memory.peak_bytes()) - before, kBlock, kSlack);
}

}  // namespace
}  // namespace farfield
