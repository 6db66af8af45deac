// SPDX-License-Identifier: Apache-2.0
#include "tools/use_text.h"

#include <gtest/gtest.h>

namespace farfield::tool {
namespace {

TEST(UseTable, SumsFramesPerAssetAndLevel) {
  RenderReport report;
  report.assets = {"oak", "rock"};
  FrameReport frame;
  frame.levels = {{{2, 300, 1, 0.25, 1 << 20, 0}, {4, 100, 1, 0.125, 1 << 10, 7}}, {}};
  frame.levels_given_up = {0.5f, 0.0f};
  report.frames = {frame, frame};
  report.frames[1].levels[0][0].resident_bytes = 0;
  report.frames[1].levels[0][0].loads = 0;
  report.frames[1].levels_given_up[0] = 1.5f;
  report.frames.emplace_back();  // of before levels were recorded
  const std::string table = use_table(report);
  EXPECT_EQ(table,
            "asset  level  loads  load s     bytes  hits   share  served coarser  given up\n"
            "  oak      2      1   0.500  1.00 MiB   600  75.0 %               0       1.5\n"
            "           4      2   0.250  1.00 KiB   200  25.0 %              14          \n");
}

}  // namespace
}  // namespace farfield::tool
