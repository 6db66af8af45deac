// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/budget_notice.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

FrameReport frame_of(int number, double bias, uint64_t asked_bytes, std::vector<float> given_up) {
  FrameReport frame;
  frame.frame = number;
  frame.bias = bias;
  frame.asked_bytes = asked_bytes;
  frame.levels_given_up = std::move(given_up);
  return frame;
}

TEST(BudgetNotice, SaysWhatWasGivenUpWhereItIsWorstAndWhatWouldDo) {
  RenderReport report;
  report.assets = {"ground", "oak", "pine"};
  report.budget_bytes = 2 << 20;
  report.frames = {frame_of(0, 0.0, 1 << 20, {0, 0, 0}), frame_of(5, 2.0, 3 << 20, {1, 3.25f, 0}),
                   frame_of(10, 0.5, 4 << 20, {0, 0.5f, 0})};
  EXPECT_EQ(budget_notice(report),
            "the budget of 2.00 MiB makes levels coarser than asked in 2 of 3 frames; at most, in frame 5: oak by 3.2 "
            "levels, ground by 1.0; 4.00 MiB would do");
}

TEST(BudgetNotice, NamesNoMoreThanThree) {
  RenderReport report;
  report.assets = {"a", "b", "c", "d"};
  report.frames = {frame_of(0, 1.0, 1, {1, 2, 3, 4})};
  EXPECT_NE(budget_notice(report)->find("d by 4.0 levels, c by 3.0, b by 2.0 and others;"), std::string::npos);
}

TEST(BudgetNotice, SaysNothingWhereNothingWasGivenUp) {
  RenderReport report;
  EXPECT_EQ(budget_notice(report), std::nullopt);
  report.assets = {"oak"};
  report.frames = {frame_of(0, 0.0, 1, {0})};
  EXPECT_EQ(budget_notice(report), std::nullopt);
}

}  // namespace
}  // namespace farfield
