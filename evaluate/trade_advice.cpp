// SPDX-License-Identifier: Apache-2.0
#include "evaluate/trade_advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "base/bytes.h"
#include "evaluate/figure_text.h"

namespace farfield {
namespace {

constexpr size_t kBase = 1;
constexpr double kScatter = 0.05;  ///< what CPU times of the same work differ by

/// A wish that is a number which should be small.
struct Wish {
  std::string name, what;
  std::function<double(const TradeSummary&)> figure;
  std::function<std::string(const TradeSummary&)> text;
};

std::vector<Wish> wishes() {
  return {{"less noise", "noise at equal CPU time", [](const TradeSummary& s) { return s.noise; },
           [](const TradeSummary& s) { return fmt::format("{:.2f}", s.noise); }},
          {"less memory", "memory", [](const TradeSummary& s) { return static_cast<double>(s.memory_bytes); },
           [](const TradeSummary& s) { return format_bytes(s.memory_bytes); }},
          {"faster", "CPU time", [](const TradeSummary& s) { return s.cpu_seconds; },
           [](const TradeSummary& s) { return fmt::format("{:.2f} s", s.cpu_seconds); }}};
}

/// What a choice does to all that was not wished for.
std::string price_text(const Wish& wish, const TradeSummary& base, const TradeSummary& chosen, bool is_yardstick) {
  std::string text =
      fmt::format("Error per pixel {} instead of {}",
                  is_yardstick ? "none (it is the yardstick)" : size_text(chosen.error), size_text(base.error));
  for (const Wish& other : wishes())
    if (other.name != wish.name)
      text +=
          fmt::format(", {} {:.2f} of the base's", other.what, ratio_or_zero(other.figure(chosen), other.figure(base)));
  return text + ".";
}

/// The best row for a wish; of those that are hardly worse, the closest to full detail.
size_t best_row(const Wish& wish, const std::vector<TradeSummary>& rows) {
  double best = wish.figure(rows[kBase]);
  for (const TradeSummary& row : rows) best = std::min(best, wish.figure(row));
  const auto error = [](const TradeSummary& row) { return row.error.value.value_or(row.error.high); };
  size_t chosen = kBase;
  bool found = false;
  for (size_t i = 0; i < rows.size(); ++i) {
    if (wish.figure(rows[i]) > (1 + kScatter) * best) continue;
    if (!found || error(rows[i]) < error(rows[chosen])) chosen = i;
    found = true;
  }
  return chosen;
}

TradeAdvice advice_for(const Wish& wish, const Trade& trade, const std::vector<TradeSummary>& rows) {
  const TradeSummary& base = rows[kBase];
  const size_t row = best_row(wish, rows);
  const double share = ratio_or_zero(wish.figure(rows[row]), wish.figure(base));
  if (row == kBase || share > 1 - kScatter)
    return {wish.name, std::nullopt,
            fmt::format("Stay at the base ({}): nothing that was tried has less {} by more than {:.0f} %.",
                        trade.base().setting.label, wish.what, 100 * kScatter)};
  return {wish.name, row,
          fmt::format("{}: {} {} instead of {} ({:.2f}). {}", trade.rows[row].setting.label, wish.what,
                      wish.text(rows[row]), wish.text(base), share, price_text(wish, base, rows[row], row == 0))};
}

TradeAdvice advice_for_closeness(const Trade& trade, const std::vector<TradeSummary>& rows) {
  const Wish closer{"closer", "error per pixel", {}, {}};
  const TradeSummary& base = rows[kBase];
  size_t chosen = kBase;
  for (size_t i = kBase + 1; i < rows.size(); ++i)
    if (rows[i].error.high < std::min(base.error.low, rows[chosen].error.high)) chosen = i;
  const std::string yardstick =
      fmt::format(" Full detail itself takes {} and {:.2f} of the base's CPU time.", format_bytes(rows[0].memory_bytes),
                  ratio_or_zero(rows[0].cpu_seconds, base.cpu_seconds));
  if (chosen == kBase)
    return {closer.name, std::nullopt,
            fmt::format("Stay at the base ({}; {}): nothing that was tried is surely closer with these samples.{}",
                        trade.base().setting.label, size_text(base.error), yardstick)};
  return {closer.name, chosen,
          fmt::format("{}: {}{}", trade.rows[chosen].setting.label, price_text(closer, base, rows[chosen], false),
                      yardstick)};
}

}  // namespace

double cpu_ratio(const Trade& trade, size_t row, size_t light) {
  return ratio_or_zero(trade.rows[row].lights[light].cost.cpu_seconds,
                       trade.full_detail().lights[light].cost.cpu_seconds);
}

double noise_at_equal_time(const Trade& trade, size_t row, size_t light) {
  return trade.rows[row].lights[light].errors.all.variance_ratio() * cpu_ratio(trade, row, light);
}

TimeRatio time_to_equal_error(const Trade& trade, size_t row, size_t light) {
  return time_to_equal_error(cpu_ratio(trade, row, light), trade.rows[row].lights[light].errors.all);
}

TimeRatio time_to_equal_error(const Trade& trade, size_t row, size_t light, size_t frame) {
  const TradeUnderLight &figures = trade.rows[row].lights[light], &full = trade.full_detail().lights[light];
  return time_to_equal_error(ratio_or_zero(figures.cost.frame_cpu_seconds[frame], full.cost.frame_cpu_seconds[frame]),
                             figures.errors.frames[frame]);
}

TradeSummary summary_of(const Trade& trade, size_t row) {
  TradeSummary summary;
  for (size_t light = 0; light < trade.rows[row].lights.size(); ++light) {
    const TradeUnderLight& figures = trade.rows[row].lights[light];
    const Bounded& error = figures.errors.all.color_rms[0];
    if (light == 0 || error.value.value_or(error.high) > summary.error.value.value_or(summary.error.high))
      summary.error = error;
    summary.cpu_seconds += figures.cost.cpu_seconds;
    summary.noise = std::max(summary.noise, noise_at_equal_time(trade, row, light));
    summary.memory_bytes = std::max(summary.memory_bytes, figures.cost.peak_accounted_bytes);
  }
  return summary;
}

std::vector<TradeAdvice> advise(const Trade& trade) {
  std::vector<TradeSummary> rows;
  for (size_t row = 0; row < trade.rows.size(); ++row) rows.push_back(summary_of(trade, row));
  std::vector<TradeAdvice> all;
  for (const Wish& wish : wishes()) all.push_back(advice_for(wish, trade, rows));
  all.push_back(advice_for_closeness(trade, rows));
  return all;
}

}  // namespace farfield
