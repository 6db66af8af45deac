// SPDX-License-Identifier: Apache-2.0
// How far a level's pictures are from its source's, with Monte-Carlo noise taken out (docs/error_metric.md).
// Pure; any thread.
#pragma once

#include <array>
#include <span>

#include "evaluate/estimate.h"
#include "evaluate/view_sums.h"
#include "path_tracer/image.h"

namespace farfield {

/// The errors over some views under some lights, as fractions (0.01 is one percent).
struct ErrorMetrics {
  Estimate occlusion_error;      ///< (mean alpha_level - mean alpha_source) / mean alpha_source
  Bounded occlusion_rms;         ///< root of the mean squared difference of alpha over all pixels
  double occlusion_rms_raw = 0;  ///< the same with the noise in it
  /// The same over the pixels that source or level touch, and after sums of 2 x 2 and 4 x 4 pixels (kBlockSides).
  std::array<Bounded, kBlockSides.size()> occlusion_rms_touched;

  std::array<Estimate, 3> color_bias;  ///< per channel (mean level - mean source) / mean source
  /// sum |mean level - mean source| / sum mean source over R, G, B: what no colour error can be below.
  Estimate color_bias_mean;
  Bounded color_error;         ///< sum |level - source| / sum source over pixels and RGB
  double color_error_raw = 0;  ///< with noise: in expectation never below the true value
  double color_error_low = 0;  ///< cross-validated: in expectation never above the true value
  double color_noise = 0;      ///< what color_error_raw would be if the level were exactly its source
  Bounded color_rest;          ///< color_error after each view's channels are scaled to the source's mean
  /// Root mean square of level - source over the mean of the source, over touched pixels and R, G, B, and after sums
  /// of 2 x 2 and 4 x 4 pixels: never below color_error (of the same pixels) and color_bias_mean.
  std::array<Bounded, kBlockSides.size()> color_rms;

  /// The channel's bias that is farthest from 0, with its sign.
  Estimate largest_color_bias() const;
};

/// The errors that the sums give. A source without any coverage (or light in a channel) gives 0 where the level has
/// none either, else infinity; sizes of errors are unknown there.
ErrorMetrics metrics_of(const ViewSums& sums);

/// The mean of the parts: the picture.
Image mean_image(std::span<const Image> parts);

}  // namespace farfield
