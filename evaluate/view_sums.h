// SPDX-License-Identifier: Apache-2.0
// What one pair of pictures, of source and level, adds to the figures: sums that add up over views and lights.
// Pure; any thread.
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "base/result.h"
#include "evaluate/estimate.h"
#include "path_tracer/image.h"

namespace farfield {

/// Every picture is rendered this often, each time from its own seed: products of *different* renders are exact in
/// expectation for noise of any distribution, and four of them also tell how far such a product is off.
inline constexpr size_t kParts = 4;

/// Pictures are compared after sums of n x n pixels.
inline constexpr std::array<int, 3> kBlockSides = {1, 2, 4};

/// A channel's values over all pixels, and the variance that noise gives these sums. Part i of the source and part i of
/// the level may share their seed, and thus noise.
struct ChannelSum {
  double source = 0, level = 0;
  double source_variance = 0, level_variance = 0, covariance = 0;

  /// Of level - gain * source.
  double variance_of_difference(double gain = 1) const {
    return std::max(0.0, level_variance + gain * gain * source_variance - 2 * gain * covariance);
  }
};

/// Squared differences without noise, over blocks of pixels.
struct SquareSum {
  double blocks = 0;  ///< that source or level touch
  double value = 0, variance = 0;
  double null_variance = 0;  ///< if all blocks were right and noisy: the sum of the squares of their values
};

/// |difference| over pixels, R, G and B, from both sides (metrics.cpp).
struct AbsoluteSides {
  double raw = 0, low = 0, high = 0;
  double low_variance = 0;       ///< rather too large than too small
  double low_null_variance = 0;  ///< if all pixels were right and noisy
};

struct ViewSums {
  double pixels = 0;
  std::array<ChannelSum, 4> channels;                 ///< R, G, B, A
  std::array<SquareSum, kBlockSides.size()> alpha{};  ///< of means over the block
  std::array<SquareSum, kBlockSides.size()> color{};  ///< of means over the block, summed over R, G, B
  AbsoluteSides sides;
  AbsoluteSides rest_sides;     ///< once the level's channels are scaled to the source's means
  double noise = 0;             ///< |a combination of the parts that holds their noise and no difference|
  double alpha_raw_square = 0;  ///< with noise

  ViewSums& operator+=(const ViewSums& other);
};

/// Parts of the source's and of the level's picture of one view. Errors: InvalidArgument unless both are kParts
/// pictures of one size with at least one pixel and channels R, G, B (premultiplied by alpha), A; and for values that
/// are not finite.
Result<ViewSums> sum_view(std::span<const Image> source, std::span<const Image> level);

}  // namespace farfield
