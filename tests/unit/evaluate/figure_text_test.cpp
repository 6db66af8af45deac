// SPDX-License-Identifier: Apache-2.0
#include "evaluate/figure_text.h"

#include <gtest/gtest.h>

#include <limits>

namespace farfield {
namespace {

TEST(FigureText, IsPercentWhereSomethingIsKnown) {
  EXPECT_EQ(size_text(ErrorSize(0.0531)), "5.31 %");
  EXPECT_EQ(size_text(ErrorSize(0.0)), "0.00 %");  // exactly: the same in every sample
  EXPECT_EQ(size_text(ErrorSize(0.00001)), "<0.01 %");
  EXPECT_EQ(estimate_text({0.012, 0.0003}), "+1.20 +- 0.03 %");
  EXPECT_EQ(estimate_text({-0.012, 0.00001}), "-1.20 +- <0.01 %");
}

TEST(FigureText, IsWordsWhereNoiseWins) {
  EXPECT_EQ(size_text(ErrorSize::unknown(0.001, 0.0035)), "unknown, 0.10 to 0.35 %");
  EXPECT_EQ(size_text(ErrorSize::unknown(0.0, 0.0035)), "unknown, at most 0.35 %");
  EXPECT_EQ(size_text(ErrorSize::unknown(0.0, 0.0)), "unknown");
  EXPECT_EQ(size_text(ErrorSize::unknown(0.0, std::numeric_limits<double>::infinity())), "unknown");
  EXPECT_EQ(estimate_text({std::numeric_limits<double>::infinity(), 0.0}), "unbounded");
}

}  // namespace
}  // namespace farfield
