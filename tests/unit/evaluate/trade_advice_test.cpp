// SPDX-License-Identifier: Apache-2.0
#include "evaluate/trade_advice.h"

#include <gtest/gtest.h>

#include "tests/support/sample_trade.h"

namespace farfield {
namespace {

const TradeAdvice& find(const std::vector<TradeAdvice>& all, const std::string& wish) {
  const auto found = std::ranges::find(all, wish, &TradeAdvice::wish);
  EXPECT_NE(found, all.end()) << wish;
  return *found;
}

TEST(TradeAdvice, NamesTheSettingThatTheFiguresAreBestFor) {
  const Trade trade = test::sample_trade();
  const auto advice = advise(trade);
  ASSERT_EQ(advice.size(), 4u);
  for (const char* wish : {"less noise", "less memory", "faster"}) {
    EXPECT_EQ(find(advice, wish).row, 3u) << wish;
    EXPECT_EQ(find(advice, wish).text.find("--pixel-error 2: "), 0u);
    EXPECT_NE(find(advice, wish).text.find("10.00 % instead of 4.00 %"), std::string::npos)
        << "the price is missing: " << find(advice, wish).text;
  }
  EXPECT_NE(find(advice, "less memory").text.find("40.00 MiB instead of 100.00 MiB (0.40)"), std::string::npos);
  EXPECT_EQ(find(advice, "closer").row, 2u);
  EXPECT_NE(find(advice, "closer").text.find("--pixel-error 0.5"), std::string::npos);
}

TEST(TradeAdvice, IsToStayWhereNothingIsBetterThanScatter) {
  Trade trade = test::sample_trade();
  for (TradeRow& row : trade.rows)
    for (TradeUnderLight& figures : row.lights) {
      figures.cost.cpu_seconds = 8 - 0.1 * static_cast<double>(row.setting.pixel_error);  // up to 3 % apart
      figures.cost.peak_accounted_bytes = 100;
      figures.errors.all.color_rms[0] = {std::nullopt, 0, 0.1, 0};
    }
  for (const TradeAdvice& advice : advise(trade)) {
    EXPECT_FALSE(advice.row) << advice.text;
    EXPECT_EQ(advice.text.find("Stay at the base (--pixel-error 1"), 0u) << advice.text;
  }
}

TEST(TradeAdvice, IsFullDetailWhereLevelsDoNotPay) {
  Trade trade = test::sample_trade();
  for (TradeUnderLight& figures : trade.rows[0].lights) figures.cost.cpu_seconds = 1;
  const auto advice = advise(trade);
  EXPECT_EQ(find(advice, "faster").row, 0u);
  EXPECT_NE(find(advice, "faster").text.find("yardstick"), std::string::npos);
  EXPECT_NE(find(advice, "closer").row, 0u);
}

TEST(TradeAdvice, OfEquallyGoodSettingsIsTheClosestOne) {
  Trade trade = test::sample_trade();
  for (size_t row : {2u, 3u})
    for (TradeUnderLight& figures : trade.rows[row].lights) figures.cost.peak_accounted_bytes = 10;
  EXPECT_EQ(find(advise(trade), "less memory").row, 2u);
}

TEST(TimeToEqualError, OfAFrameIsByItsOwnTimeAndError) {
  Trade trade = test::sample_trade();
  TradeUnderLight& figures = trade.rows[1].lights[0];
  figures.cost.frame_cpu_seconds = {4, 1};  // full detail takes 5 in each
  figures.errors.frames[1].color_rms[0] = {0.0, 0, 0, 0};
  EXPECT_NEAR(time_to_equal_error(trade, 1, 0, 1).value.value(), 1.0 / 5, 1e-12);
  EXPECT_NEAR(time_to_equal_error(trade, 1, 0, 0).value.value(), 4.0 / 5 * 0.01 / (0.01 - 0.04 * 0.04), 1e-12);
}

TEST(TradeSummary, IsOfTheWorstLight) {
  Trade trade = test::sample_trade();
  trade.rows[1].lights[1].errors.all.color_rms[0] = {0.3, 0.2, 0.4, 0};
  trade.rows[1].lights[1].errors.all.variance = 0.05;
  const TradeSummary summary = summary_of(trade, 1);
  EXPECT_EQ(summary.error.value.value(), 0.3);
  EXPECT_EQ(summary.cpu_seconds, 16);
  EXPECT_NEAR(summary.noise, 0.05 * 8 / (0.01 * 10), 1e-12);
}

}  // namespace
}  // namespace farfield
