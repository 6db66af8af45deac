// SPDX-License-Identifier: Apache-2.0
#include "evaluate/figure_text.h"

#include <fmt/format.h>

#include <cmath>

namespace farfield {
namespace {

constexpr double kSmallestShown = 0.005e-2;  // what two digits of a percent round to 0.01

/// A size without its unit.
std::string percents(double fraction) {
  if (!std::isfinite(fraction)) return "unbounded";
  return fraction > 0 && fraction < kSmallestShown ? "<0.01" : fmt::format("{:.2f}", 100 * fraction);
}

}  // namespace

std::string size_text(const ErrorSize& size) {
  if (size.value) return percents(*size.value) + " %";
  if (!std::isfinite(size.high) || !(size.high > 0)) return "unknown";
  if (size.low < kSmallestShown) return fmt::format("unknown, at most {} %", percents(size.high));
  return fmt::format("unknown, {} to {} %", percents(size.low), percents(size.high));
}

std::string size_text(const Bounded& size) { return size_text(size.size()); }

std::string estimate_text(const Estimate& estimate) {
  if (!std::isfinite(estimate.value)) return "unbounded";
  return fmt::format("{:+.2f} +- {} %", 100 * estimate.value, percents(estimate.standard_error));
}

}  // namespace farfield
