// SPDX-License-Identifier: Apache-2.0
// Numbers that a Monte-Carlo comparison can give, and those that it cannot: what noise hides is said to be unknown,
// with bounds, instead of 0 (docs/error_metric.md, "Noise"). Pure; any thread.
#pragma once

#include <optional>

#include "cache/manifest.h"

namespace farfield {

/// How many standard errors a difference must stand out of the noise to count as seen, and how far bounds reach.
inline constexpr double kCertainty = 3.0;

/// A number and its standard error from Monte-Carlo noise.
struct Estimate {
  double value = 0;
  double standard_error = 0;
};

/// A size of an error, >= 0. `value` is absent where noise wins; the bounds hold all the same.
struct Bounded {
  std::optional<double> value;
  double low = 0, high = 0;   ///< the truth lies between, kCertainty standard errors included
  double standard_error = 0;  ///< of value

  ErrorSize size() const { return value ? ErrorSize(*value) : ErrorSize::unknown(low, high); }
};

/// A share of |d| from independent parts of d: the value of one with the sign of the others, 0 where they have none.
inline double with_sign_of_others(double value, double others) {
  return others > 0 ? value : (others < 0 ? -value : 0.0);
}

/// A sum of what many pixels say, and whether that is more than noise.
struct Evidence {
  Estimate estimate;
  /// The standard error if all of it were noise: the root of the sum of the pixels' squares. Noise that sits in few
  /// pixels can look certain by its own standard error, but never by this one.
  double null_error = 0;

  bool stands_out() const;
};

/// The root of a square that is known as an unbiased, perhaps negative, estimate. floor: what the root cannot be below.
Bounded root_of(const Evidence& square, const Estimate& floor = {});

/// What is known of a sum of absolute values, all in the unit of the result.
struct AbsoluteSum {
  Evidence low;      ///< in expectation never above the truth, and 0 if the truth is
  double high = 0;   ///< in expectation never below the truth, with as much of the data as `low` has its signs from
  double raw = 0;    ///< the same with all data
  double limit = 0;  ///< another upper bound
  Estimate floor;    ///< the absolute value of the sum: another lower bound
};
/// The sum: the geometric mean of both sides (metrics.cpp), never below the floor.
Bounded absolute_of(const AbsoluteSum& sum);

}  // namespace farfield
