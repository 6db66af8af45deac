// SPDX-License-Identifier: Apache-2.0
#include "evaluate/svg_plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <regex>

namespace farfield {
namespace {

TEST(Ticks, AreRoundAndInside) {
  EXPECT_EQ(linear_ticks(0, 10), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(linear_ticks(-3, 103), (std::vector<double>{0, 50, 100}));
  EXPECT_EQ(log_ticks(0.5, 20000), (std::vector<double>{1, 10, 100, 1000, 10000}));
  EXPECT_EQ(log_ticks(0.9, 6), (std::vector<double>{1, 2, 5}));
  for (const auto& [low, high] : {std::pair(3.1, 3.7), std::pair(1e-7, 2e-7), std::pair(0.2, 9e9)})
    for (const auto& ticks : {linear_ticks(low, high), log_ticks(low, high)}) {
      EXPECT_GE(ticks.size(), 2u);
      EXPECT_LE(ticks.size(), 12u);
      for (const double tick : ticks) EXPECT_TRUE(tick >= low && tick <= high) << tick;
    }
}

TEST(XmlText, EscapesWhatXmlTakesForItsOwn) {
  EXPECT_EQ(xml_text("a < b & \"c\" > d\x01"), "a &lt; b &amp; &quot;c&quot; &gt; d?");
}

/// x and y of the first series' points, in pixels.
std::vector<std::array<double, 2>> drawn_points(const std::string& svg) {
  std::vector<std::array<double, 2>> points;
  const std::regex circle("<circle cx=\"([0-9.]+)\" cy=\"([0-9.]+)\"");
  for (std::sregex_iterator it(svg.begin(), svg.end(), circle), end; it != end; ++it)
    points.push_back({std::stod((*it)[1]), std::stod((*it)[2])});
  return points;
}

TEST(SvgPlot, PutsPointsWhereTheirValuesAre) {
  const auto linear = drawn_points(svg_of({"t", "x", "y", false, false, {{"s", 1, {{0, 0}, {1, 5}, {2, 10}}}}}));
  ASSERT_EQ(linear.size(), 3u);
  EXPECT_NEAR(linear[1][0], 0.5 * (linear[0][0] + linear[2][0]), 0.1);
  EXPECT_NEAR(linear[1][1], 0.5 * (linear[0][1] + linear[2][1]), 0.1);
  EXPECT_LT(linear[0][0], linear[2][0]);
  EXPECT_GT(linear[0][1], linear[2][1]) << "larger values are higher";
  const auto log = drawn_points(svg_of({"t", "x", "y", true, true, {{"s", 1, {{1, 0.1}, {10, 1}, {100, 10}}}}}));
  ASSERT_EQ(log.size(), 3u);
  for (int side : {0, 1}) EXPECT_NEAR(log[1][side], 0.5 * (log[0][side] + log[2][side]), 0.1);
}

TEST(SvgPlot, LeavesOutWhatCannotBeShown) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  Plot plot{"t", "x", "y", true, false, {{"s", 0, {{0, 1}, {-1, 1}, {nan, 1}, {1, infinity}, {2, 3}}}}};
  const std::string svg = svg_of(plot);
  EXPECT_EQ(drawn_points(svg).size(), 1u);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  plot.series.clear();
  EXPECT_EQ(svg_of(plot).find("nan"), std::string::npos);
}

}  // namespace
}  // namespace farfield
