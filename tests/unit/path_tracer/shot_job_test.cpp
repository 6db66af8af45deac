// SPDX-License-Identifier: Apache-2.0
#include "samples/path_tracer/shot_job.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

TEST(ParseFrameRange, ReadsRangesStepsAndSingleFrames) {
  const auto range = parse_frame_range("0-120:10");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 0);
  EXPECT_EQ(range->last, 120);
  EXPECT_EQ(range->step, 10);
  EXPECT_EQ(range->count(), 13);
  EXPECT_EQ(parse_frame_range("3-5")->count(), 3);
  EXPECT_EQ(parse_frame_range("7")->count(), 1);
  EXPECT_EQ(parse_frame_range("0-9:4")->count(), 3);
}

TEST(ParseFrameRange, RefusesTheRest) {
  for (const char* text : {"", "-", "a", "5-", "-5", "5-3", "1-5:", "1-5:0", "1-5:-1", "1-5x", "1 - 5", "1-5:2:3",
                           "99999999999", "0-99999999", "0x1-5"}) {
    const auto range = parse_frame_range(text);
    ASSERT_FALSE(range) << text;
    EXPECT_EQ(range.error().code, ErrorCode::InvalidArgument);
  }
}

}  // namespace
}  // namespace farfield
