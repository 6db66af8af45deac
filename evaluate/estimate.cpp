// SPDX-License-Identifier: Apache-2.0
#include "evaluate/estimate.h"

#include <algorithm>
#include <cmath>

namespace farfield {
namespace {

double surely_above(const Estimate& estimate) {
  return std::max(0.0, estimate.value - kCertainty * estimate.standard_error);
}
/// If it does not stand out, not even that much is sure.
double surely_above(const Evidence& evidence) { return evidence.stands_out() ? surely_above(evidence.estimate) : 0.0; }

double surely_below(const Evidence& evidence) {
  const double error = evidence.stands_out() ? evidence.estimate.standard_error
                                             : std::max(evidence.estimate.standard_error, evidence.null_error);
  return std::max(0.0, evidence.estimate.value + kCertainty * error);
}

}  // namespace

bool Evidence::stands_out() const {
  if (!(estimate.value > kCertainty * estimate.standard_error)) return false;
  // So sharp that few pixels are enough: a tenth of what all of it would be as noise.
  const bool is_sharp = estimate.standard_error < 0.1 * null_error;
  return is_sharp || estimate.value > kCertainty * null_error;
}

Bounded root_of(const Evidence& square, const Estimate& floor) {
  Bounded root;
  root.low = std::max(std::sqrt(surely_above(square)), surely_above(floor));
  root.high = std::max({root.low, floor.value, std::sqrt(surely_below(square))});
  const bool is_exactly_zero = square.estimate.value == 0 && square.null_error == 0;
  if (!is_exactly_zero && !square.stands_out()) return root;
  const double value = std::sqrt(square.estimate.value);
  root.value = std::max(floor.value, value);
  root.standard_error = value > 0 ? square.estimate.standard_error / (2 * value) : 0.0;
  return root;
}

Bounded absolute_of(const AbsoluteSum& sum) {
  Bounded result;
  result.low = std::max(surely_above(sum.low), surely_above(sum.floor));
  result.high = std::max({result.low, sum.floor.value, std::min(sum.raw, sum.limit)});
  if (sum.raw == 0) result.value = 0.0;  // equal in every sample: no noise either
  if (!sum.low.stands_out()) return result;
  const Estimate& low = sum.low.estimate;
  result.value = std::max(sum.floor.value, std::min(std::sqrt(sum.high * low.value), result.high));
  // Both sides move with the data: together where noise is small, the lower one alone where it is large.
  const double spread = std::sqrt(sum.high / low.value);
  result.standard_error = 0.5 * low.standard_error * (spread + 1.0 / spread);
  return result;
}

}  // namespace farfield
