// SPDX-License-Identifier: Apache-2.0
#include "tools/progress.h"

#include <gtest/gtest.h>

#include <limits>

namespace farfield {
namespace {

TEST(FormatDuration, ReadsAsPeopleWriteIt) {
  EXPECT_EQ(format_duration(0), "0:00");
  EXPECT_EQ(format_duration(41.6), "0:42");
  EXPECT_EQ(format_duration(187), "3:07");
  EXPECT_EQ(format_duration(3729), "1:02:09");
  EXPECT_EQ(format_duration(-5), "0:00");
  EXPECT_EQ(format_duration(std::numeric_limits<double>::quiet_NaN()), "0:00");
}

TEST(ProgressText, ShowsShareAndTimeLeft) {
  EXPECT_EQ(progress_text(0.5, "frame 3/10", 60), "frame 3/10 [##########          ]  50 %  1:00 left");
  EXPECT_EQ(progress_text(1, "x", 60), "x [####################] 100 %");
  EXPECT_EQ(progress_text(0, "x", 60), "x [                    ]   0 %");
  EXPECT_EQ(progress_text(-1, "x", 60), progress_text(0, "x", 60));
  EXPECT_EQ(progress_text(7, "x", 60), progress_text(1, "x", 60));
  EXPECT_EQ(progress_text(std::numeric_limits<double>::quiet_NaN(), "x", 60), progress_text(0, "x", 60));
}

TEST(ProgressLine, SaysNothingInAPipe) {
  testing::internal::CaptureStderr();  // into a file: not a terminal
  {
    ProgressLine line;
    line.update(0.5, "work");
    line.clear();
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace farfield
