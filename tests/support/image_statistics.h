// SPDX-License-Identifier: Apache-2.0
// Means of noisy images with their standard error.
#pragma once

#include <cmath>

#include "path_tracer/asset_view.h"

namespace farfield::test {

/// Two-sided 4.9 sigma is 1e-6: a right renderer fails one of a thousand comparisons in a thousand runs of other seeds.
inline constexpr double kSigmas = 4.9;

struct MeanEstimate {
  double value = 0;
  double standard_error = 0;
};

/// The mean over all pixels of value(pixel), which is linear in R, G, B, A. The two halves differ by noise alone: half
/// of the squared difference is the variance of either, and a quarter that of their mean.
template <typename Value>
MeanEstimate estimate_of(const ViewImages& images, const Value& value) {
  const size_t count = images.mean.values.size() / 4;
  double sum = 0, variance = 0;
  for (size_t i = 0; i < count; ++i) {
    const double a = value(&images.half[0].values[4 * i]), b = value(&images.half[1].values[4 * i]);
    sum += static_cast<double>(value(&images.mean.values[4 * i]));
    variance += 0.25 * (a - b) * (a - b);
  }
  const auto n = static_cast<double>(count);
  return {sum / n, std::sqrt(variance) / n};
}

}  // namespace farfield::test
