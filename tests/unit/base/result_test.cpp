// SPDX-License-Identifier: Apache-2.0
#include "base/result.h"

#include <gtest/gtest.h>

#include <memory>

namespace farfield {
namespace {

Result<std::unique_ptr<int>> make(int value) {
  if (value < 0) return make_error(ErrorCode::InvalidArgument, "negative");
  return std::make_unique<int>(value);
}

Result<void> check(int value) {
  FARFIELD_TRY(make(value));
  return {};
}

Result<int> sum(int a, int b) {
  FARFIELD_TRY_LET(const std::unique_ptr<int> first, make(a));
  FARFIELD_TRY_LET(const auto second, make(b));
  return *first + *second;
}

TEST(Try, HandsOnTheErrorAndOtherwiseGoesOn) {
  EXPECT_TRUE(check(1));
  ASSERT_FALSE(check(-1));
  EXPECT_EQ(check(-1).error().message, "negative");
}

TEST(Try, LetMovesTheValueOut) {
  EXPECT_EQ(sum(1, 2).value(), 3);
  ASSERT_FALSE(sum(1, -2));
  EXPECT_EQ(sum(1, -2).error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace farfield
