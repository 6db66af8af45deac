// SPDX-License-Identifier: Apache-2.0
// Noise. With D = level - source per pixel and channel, known only as d + noise, sum |D| over-estimates sum |d|. The
// parts give a second estimate from the other side: the sign of d is taken from all parts but one, the value from the
// one left out. They are independent, so E[D_j sign(D_-j)] = d E[sign(D_-j)] <= |d|, and it is exactly 0 where d = 0.
// For Gaussian d and noise, E[|D_-j|] E[D_j sign(D_-j)] = (2 / pi) var(d) = E[|d|]^2: the geometric mean of the two
// sums is what is reported. It is exact, too, where noise is small. No such care is needed for squares, see
// add_square() in view_sums.cpp; and as sum |d| <= sqrt(n sum d^2), they bound the sum from above far below the noise.
#include "evaluate/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfield {
namespace {

double ratio(double numerator, double denominator) {
  if (denominator > 0) return numerator / denominator;
  return numerator == 0 ? 0.0 : std::copysign(std::numeric_limits<double>::infinity(), numerator);
}

/// (level - source) / source.
Estimate relative_error(const ChannelSum& channel) {
  const double error = ratio(channel.level - channel.source, channel.source);
  const double gain = ratio(channel.level, channel.source);
  return {error, ratio(std::sqrt(channel.variance_of_difference(gain)), channel.source)};
}

/// The mean square of blocks, in units of `unit` squared. Noise of noise can leave a variance below 0.
Evidence mean_square(const SquareSum& sum, double count, double unit) {
  const double scale = count * unit * unit;
  return {{ratio(sum.value, scale), ratio(std::sqrt(std::max(0.0, sum.variance)), scale)},
          ratio(std::sqrt(sum.null_variance), scale)};
}

Estimate bias_mean(const ViewSums& sums, double light) {
  double difference = 0, deviation = 0;
  for (size_t c = 0; c < 3; ++c) {
    const ChannelSum& channel = sums.channels[c];
    difference += std::abs(channel.level - channel.source);
    deviation += std::sqrt(channel.variance_of_difference());  // the channels are noisy together
  }
  return {ratio(difference, light), ratio(deviation, light)};
}

Bounded absolute_error(const AbsoluteSides& sides, double light, double limit, const Estimate& floor) {
  return absolute_of(
      {{{sides.low / light, std::sqrt(sides.low_variance) / light}, std::sqrt(sides.low_null_variance) / light},
       sides.high / light,
       sides.raw / light,
       limit,
       floor});
}

void set_occlusion(const ViewSums& sums, ErrorMetrics& m) {
  m.occlusion_error = relative_error(sums.channels[3]);
  m.occlusion_rms_raw = std::sqrt(ratio(sums.alpha_raw_square, sums.pixels));
  if (!(sums.alpha[0].blocks > 0)) return;  // nothing was seen: nothing is known
  m.occlusion_rms = root_of(mean_square(sums.alpha[0], sums.pixels, 1.0));
  for (size_t i = 0; i < kBlockSides.size(); ++i)
    m.occlusion_rms_touched[i] = root_of(mean_square(sums.alpha[i], sums.alpha[i].blocks, 1.0));
}

void set_color(const ViewSums& sums, ErrorMetrics& m) {
  const double light = sums.channels[0].source + sums.channels[1].source + sums.channels[2].source;
  for (size_t c = 0; c < 3; ++c) m.color_bias[c] = relative_error(sums.channels[c]);
  m.color_bias_mean = bias_mean(sums, light);
  m.color_error_raw = ratio(sums.sides.raw, light);
  m.color_error_low = ratio(sums.sides.low, light);
  m.color_noise = ratio(sums.noise, light);
  if (!(light > 0)) {  // a share of nothing
    for (Bounded* figure : {&m.color_error, &m.color_rest}) figure->high = m.color_error_raw;
    for (Bounded& figure : m.color_rms) figure.high = m.color_error_raw;
    return;
  }
  for (size_t i = 0; i < kBlockSides.size(); ++i) {
    // Means over blocks: their sum over all blocks is the light over the block's area.
    const double values = 3.0 * sums.color[i].blocks, area = static_cast<double>(kBlockSides[i]) * kBlockSides[i];
    m.color_rms[i] = root_of(mean_square(sums.color[i], values, light / (area * values)), m.color_bias_mean);
  }
  m.color_error = absolute_error(sums.sides, light, m.color_rms[0].high, m.color_bias_mean);
  m.color_rest = absolute_error(sums.rest_sides, light, std::numeric_limits<double>::infinity(), {});
}

}  // namespace

Estimate ErrorMetrics::largest_color_bias() const {
  return *std::max_element(color_bias.begin(), color_bias.end(),
                           [](const Estimate& a, const Estimate& b) { return std::abs(a.value) < std::abs(b.value); });
}

ErrorMetrics metrics_of(const ViewSums& sums) {
  ErrorMetrics metrics;
  set_occlusion(sums, metrics);
  set_color(sums, metrics);
  return metrics;
}

Image mean_image(std::span<const Image> parts) {
  if (parts.empty()) return {};
  Image mean(parts.front().width, parts.front().height, parts.front().channels);
  const float weight = 1.0f / static_cast<float>(parts.size());
  for (const Image& part : parts)
    for (size_t i = 0; i < mean.values.size(); ++i) mean.values[i] += weight * part.values[i];
  return mean;
}

}  // namespace farfield
