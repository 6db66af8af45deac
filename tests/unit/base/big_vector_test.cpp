// SPDX-License-Identifier: Apache-2.0
#include "base/big_vector.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <numeric>

#include "base/process_memory.h"
#include "tests/support/files.h"

namespace farfield {
namespace {

constexpr size_t kLarge = kScratchFromBytes / sizeof(uint64_t) + 5;

/// TMPDIR is this folder, meanwhile.
struct TemporaryPlace {
  explicit TemporaryPlace(const std::filesystem::path& folder) { setenv("TMPDIR", folder.c_str(), 1); }
  ~TemporaryPlace() { unsetenv("TMPDIR"); }
};

TEST(BigVector, KeepsWhatItHoldsThroughRestsAndGrowth) {
  BigVector<uint64_t> numbers(kLarge);
  std::iota(numbers.begin(), numbers.end(), uint64_t{3});
  rest(numbers);
  EXPECT_EQ(numbers[0], 3u);
  EXPECT_EQ(numbers[kLarge / 2], kLarge / 2 + 3);
  numbers[kLarge / 2] = 1;
  rest(numbers);
  numbers.push_back(7);  // copies it
  EXPECT_EQ(numbers[kLarge / 2], 1u);
  EXPECT_EQ(numbers[kLarge - 1], kLarge + 2);
  EXPECT_EQ(numbers.back(), 7u);
  BigVector<uint64_t> small = {1, 2, 3};
  rest(small);
  EXPECT_EQ(small, (BigVector<uint64_t>{1, 2, 3}));
}

TEST(BigVector, RestsOutsideOfTheProcess) {
  BigVector<uint64_t> numbers(kLarge, 1);
  const uint64_t before = mapped_set_bytes();
  rest(numbers);
  EXPECT_LT(mapped_set_bytes() + kScratchFromBytes / 2, before);
}

TEST(BigVector, LeavesNoFiles) {
  const test::TemporaryFolder folder;
  const TemporaryPlace place(folder.path());
  const BigVector<uint64_t> numbers(kLarge);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(BigVector, WithoutRoomItIsAnErrorThatNamesTheFolder) {
  const TemporaryPlace nowhere("/proc/farfield-is-not-here");
  const auto made = with_scratch([]() -> Result<size_t> { return BigVector<uint64_t>(kLarge).size(); });
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::Io);
  EXPECT_NE(made.error().message.find("TMPDIR"), std::string::npos) << made.error().message;
  EXPECT_TRUE(with_scratch([]() -> Result<size_t> { return BigVector<uint64_t>(5).size(); }));  // small ones need none
}

}  // namespace
}  // namespace farfield
