// SPDX-License-Identifier: Apache-2.0
// A trade with made-up figures.
#pragma once

#include "evaluate/trade.h"

namespace farfield::test {

/// Full detail, the base, and pixel errors 0.5 and 2: closer, dearer and larger; farther, cheaper and smaller. Two
/// lights, two frames, noise that is the same everywhere.
inline Trade sample_trade() {
  Trade trade;
  trade.scene = "forest & <lake>.glb";
  trade.frames = {0, 10};
  trade.width = 4, trade.height = 2, trade.samples_per_pixel = 8, trade.threads = 2;
  const std::vector<TradeSetting> settings = settings_of({.pixel_error = {1.0f, 0.5f, 2.0f}}, uint64_t{1} << 40);
  const double errors[] = {0, 0.04, 0.02, 0.10}, seconds[] = {10, 8, 12, 4};
  const uint64_t memory[] = {800 << 20, 100 << 20, 200 << 20, 40 << 20};
  for (size_t i = 0; i < settings.size(); ++i) {
    TradeUnderLight figures;
    figures.errors.all.color_rms[0] = {errors[i], 0.9 * errors[i], 1.1 * errors[i], 0.02 * errors[i]};
    figures.errors.all.color_bias = {Estimate{-errors[i] / 4, 0.001}, Estimate{0, 0.001}, Estimate{0.003, 0.001}};
    figures.errors.all.variance = figures.errors.all.full_variance = 0.01;
    figures.errors.frames.assign(2, figures.errors.all);
    figures.cost = {seconds[i], seconds[i] / 2, 0.1, 1e6, memory[i], memory[i] + 1, {seconds[i] / 2, seconds[i] / 2}};
    figures.changes = {{0.5 + errors[i], 0.4, 0.6, 0.01}};
    figures.pop = {{errors[i], -0.1, 0.2, 0.01}, {0, 10}, {{errors[i], -0.1, 0.2, 0.01}}};
    TradeUnderLight turned = figures;
    turned.light = TradeLight::Turned;
    trade.rows.push_back({settings[i], {figures, turned}});
  }
  return trade;
}

}  // namespace farfield::test
