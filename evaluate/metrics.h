// SPDX-License-Identifier: Apache-2.0
// How far a level's pictures are from its source's, with Monte-Carlo noise taken out (docs/error_metric.md).
// Pure; one thread at a time per object.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/result.h"
#include "path_tracer/image.h"

namespace farfield {

/// A number and its standard error from Monte-Carlo noise.
struct Estimate {
  double value = 0;
  double standard_error = 0;
};

/// The errors of one level over all views, as fractions (0.01 is one percent).
struct ErrorMetrics {
  Estimate occlusion_error;            ///< (mean alpha_level - mean alpha_source) / mean alpha_source
  Estimate occlusion_rms;              ///< root of the mean squared difference of alpha over all pixels, without noise
  double occlusion_rms_raw = 0;        ///< the same with the noise in it
  Estimate color_error;                ///< sum |level - source| / sum source over pixels and RGB, without noise
  double color_error_raw = 0;          ///< as measured: in expectation never below the true value
  double color_error_low = 0;          ///< cross-validated: in expectation never above the true value
  double color_noise = 0;              ///< what color_error_raw would be if the level were exactly its source
  std::array<Estimate, 3> color_bias;  ///< per channel (mean level - mean source) / mean source
  Estimate color_rest;                 ///< color_error after each view's channels are scaled to the source's mean
};

/// Adds up views and gives the errors. Each picture comes in the same number of parts: independent, equally good
/// estimates of the same pixels, whose mean is the picture.
class ErrorAccumulator {
 public:
  /// Parts of the source's and of the level's picture of one view. Errors: InvalidArgument unless both have the same
  /// number of parts (3 to 16, the same in every view), all have one size with at least one pixel, and channels R, G, B
  /// (premultiplied by alpha), A; and for values that are not finite.
  Result<void> add_view(std::span<const Image> source, std::span<const Image> level);

  /// Errors over the views so far. A source without any coverage (or light in a channel) gives 0 where the level has
  /// none either, else infinity.
  ErrorMetrics metrics() const;

 private:
  struct Sums {
    double pixels = 0;
    double alpha_squares = 0;                 ///< of the mean difference
    double alpha_products = 0;                ///< of differences of different parts: squares without noise
    std::array<double, 4> source{}, level{};  ///< R, G, B, A
    double raw = 0, noise = 0;                ///< |mean difference|, |noise of it|
    double low = 0, high = 0;                 ///< bounds of the difference without noise, metrics.cpp
    double rest_low = 0, rest_high = 0;
  };
  static void add_subset(std::span<const Image> source, std::span<const Image> level, size_t left_out, Sums& sums);
  static ErrorMetrics evaluate(const Sums& sums);

  std::vector<Sums> sums_;  ///< [0]: all parts; [1 + j]: all but part j, for standard errors
};

/// The mean of the parts: the picture.
Image mean_image(std::span<const Image> parts);

}  // namespace farfield
