// SPDX-License-Identifier: Apache-2.0
// Which knob to turn for which wish, as the figures of a trade have it. Pure; any thread.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "evaluate/trade.h"

namespace farfield {

/// One row over all its lights.
struct TradeSummary {
  double cpu_seconds = 0;     ///< of the shots under all lights
  double noise = 0;           ///< variance times CPU time, over full detail's: noise at equal time; of the worst light
  Bounded error;              ///< per pixel (color_rms); of the light where it is, or may be, the largest
  uint64_t memory_bytes = 0;  ///< highest accounted
};
TradeSummary summary_of(const Trade& trade, size_t row);

/// A row's figures under one light over full detail's: CPU time; variance times CPU time, 0 if full detail has no
/// noise; time to full detail's error, of the shot and of the frame of an index.
double cpu_ratio(const Trade& trade, size_t row, size_t light);
double noise_at_equal_time(const Trade& trade, size_t row, size_t light);
TimeRatio time_to_equal_error(const Trade& trade, size_t row, size_t light);
TimeRatio time_to_equal_error(const Trade& trade, size_t row, size_t light, size_t frame);

struct TradeAdvice {
  std::string wish;           ///< "less noise", "less memory", "faster", "closer"
  std::optional<size_t> row;  ///< to be chosen; nothing: stay at the base
  std::string text;           ///< one line: what it brings against the base, and what it costs
};
/// For each wish the row that fulfils it best, if it does so by more than measurements scatter: 5 %, or, for closeness,
/// the bounds of both. Full detail is one of them, but for closeness, where it is the yardstick.
std::vector<TradeAdvice> advise(const Trade& trade);

}  // namespace farfield
