// SPDX-License-Identifier: Apache-2.0
#include "evaluate/view_sums.h"

#include <algorithm>
#include <cmath>

#include "base/result.h"

namespace farfield {
namespace {

using Parts = std::span<const Image>;
using PartValues = std::array<double, kParts>;

constexpr double kPartCount = kParts;

double sum_of(const PartValues& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

/// Of two means, as their parts show it in pairs.
double covariance_of_means(const PartValues& a, const PartValues& b) {
  const double mean_a = sum_of(a) / kPartCount, mean_b = sum_of(b) / kPartCount;
  double products = 0;
  for (size_t part = 0; part < kParts; ++part) products += (a[part] - mean_a) * (b[part] - mean_b);
  return products / (kPartCount * (kPartCount - 1.0));
}

/// Of the mean of the parts, as their spread shows it.
double variance_of_mean(const PartValues& values) { return covariance_of_means(values, values); }

/// A combination of the parts with the noise of their mean and none of what they share.
double noise_of(const PartValues& values) { return (values[0] - values[1] + values[2] - values[3]) / kPartCount; }

PartValues values_at(Parts parts, size_t index) {
  PartValues values;
  for (size_t part = 0; part < kParts; ++part) values[part] = static_cast<double>(parts[part].values[index]);
  return values;
}

/// level * scale - source, in every part.
PartValues difference_at(Parts source, Parts level, size_t index, double scale = 1.0) {
  const PartValues s = values_at(source, index);
  PartValues difference = values_at(level, index);
  for (size_t part = 0; part < kParts; ++part) difference[part] = scale * difference[part] - s[part];
  return difference;
}

Result<void> check_parts(Parts source, Parts level) {
  if (source.size() != kParts || level.size() != kParts)
    return make_error(ErrorCode::InvalidArgument, "source and level need four parts each");
  const std::vector<std::string> rgba = {"R", "G", "B", "A"};
  const Image& first = source.front();
  for (const auto& images : {source, level})
    for (const Image& image : images) {
      if (image.width != first.width || image.height != first.height || image.values.empty())
        return make_error(ErrorCode::InvalidArgument, "the pictures of a view must have one size, not empty");
      if (image.channels != rgba)
        return make_error(ErrorCode::InvalidArgument, "the pictures of a view must have channels R, G, B, A");
      if (!std::all_of(image.values.begin(), image.values.end(), [](float value) { return std::isfinite(value); }))
        return make_error(ErrorCode::InvalidArgument, "a picture has pixels that are not finite");
    }
  return {};
}

// ---- squares of blocks ----

/// The differences of n x n pixels, in every part and channel.
struct Block {
  std::array<PartValues, 4> difference{};
  bool touched = false;  ///< by the source or the level, in any part
};

Block block_at(Parts source, Parts level, int x_begin, int y_begin, int side) {
  Block block;
  const Image& first = source.front();
  const int x_end = std::min(x_begin + side, first.width), y_end = std::min(y_begin + side, first.height);
  for (int y = y_begin; y < y_end; ++y)
    for (int x = x_begin; x < x_end; ++x) {
      const size_t pixel = 4 * (static_cast<size_t>(y) * static_cast<size_t>(first.width) + static_cast<size_t>(x));
      for (size_t part = 0; part < kParts; ++part) {
        for (size_t c = 0; c < 4; ++c)
          block.difference[c][part] +=
              static_cast<double>(level[part].values[pixel + c]) - static_cast<double>(source[part].values[pixel + c]);
        if (source[part].values[pixel + 3] > 0 || level[part].values[pixel + 3] > 0) block.touched = true;
      }
    }
  const double area = static_cast<double>(side) * side;
  for (PartValues& values : block.difference)
    for (double& value : values) value /= area;
  return block;
}

/// Adds the squared length of a vector d that is known as d + noise in four independent parts. With the products
/// p_ij = D_i . D_j of different parts, E[p_ij] = |d|^2, and E[p_ij p_kl] = |d|^4 for four different parts: so the mean
/// U of all six is the square, and U^2 less the mean of the three pairs of pairs its variance. Both are exact in
/// expectation for any noise.
void add_square(std::span<const PartValues> vector, SquareSum& sum) {
  const auto product = [&](size_t i, size_t j) {
    double dot = 0;
    for (const PartValues& component : vector) dot += component[i] * component[j];
    return dot;
  };
  const double p01 = product(0, 1), p23 = product(2, 3), p02 = product(0, 2), p13 = product(1, 3), p03 = product(0, 3),
               p12 = product(1, 2);
  const double mean = (p01 + p23 + p02 + p13 + p03 + p12) / 6.0;
  sum.value += mean;
  sum.null_variance += mean * mean;
  sum.variance += mean * mean - (p01 * p23 + p02 * p13 + p03 * p12) / 3.0;
}

void add_blocks(Parts source, Parts level, int side, SquareSum& alpha, SquareSum& color) {
  for (int y = 0; y < source.front().height; y += side)
    for (int x = 0; x < source.front().width; x += side) {
      const Block block = block_at(source, level, x, y, side);
      if (!block.touched) continue;
      alpha.blocks += 1, color.blocks += 1;
      add_square(std::span(block.difference).subspan(3, 1), alpha);
      add_square(std::span(block.difference).subspan(0, 3), color);
    }
}

// ---- sums over pixels ----

void add_channels(Parts source, Parts level, ViewSums& sums) {
  for (size_t i = 0; i < source.front().values.size(); ++i) {
    ChannelSum& channel = sums.channels[i % 4];
    const PartValues s = values_at(source, i), l = values_at(level, i);
    channel.source += sum_of(s) / kPartCount;
    channel.level += sum_of(l) / kPartCount;
    channel.source_variance += variance_of_mean(s);
    channel.level_variance += variance_of_mean(l);
    channel.covariance += covariance_of_means(s, l);
    const PartValues difference = difference_at(source, level, i);
    if (i % 4 == 3) {
      const double mean = sum_of(difference) / kPartCount;
      sums.alpha_raw_square += mean * mean;
    } else {
      sums.noise += std::abs(noise_of(difference));
    }
  }
}

/// One pixel and channel's part in the sums of metrics.cpp: D_j sign(D_-j) and |D_-j|, means over the parts j. Returns
/// the first.
double add_sides(const PartValues& difference, AbsoluteSides& sides) {
  const double sum = sum_of(difference);
  double low = 0, high = 0;
  for (const double value : difference) {
    const double others = sum - value;
    low += with_sign_of_others(value, others);
    high += std::abs(others);
  }
  sides.raw += std::abs(sum / kPartCount);
  sides.low += low / kPartCount;
  sides.high += high / (kPartCount * (kPartCount - 1.0));
  return low / kPartCount;
}

AbsoluteSides sum_sides(Parts source, Parts level, const std::array<double, 3>& scale) {
  AbsoluteSides sides;
  for (size_t pixel = 0; pixel < source.front().values.size(); pixel += 4) {
    double deviation = 0, low = 0;  // of all channels: those of a path are noisy together
    for (size_t c = 0; c < 3; ++c) {
      const PartValues difference = difference_at(source, level, pixel + c, scale[c]);
      low += add_sides(difference, sides);
      deviation += std::sqrt(variance_of_mean(difference));
    }
    // The four signs of a pixel share data: without a difference the variance of `low` is larger than that of the mean,
    // with one it comes down to it. The factor is a guess that a test with Gaussian noise holds to 25 %.
    constexpr double kSharedSigns = 1.7;
    sides.low_variance += kSharedSigns * deviation * deviation;
    sides.low_null_variance += low * low;
  }
  return sides;
}

/// What brings the level's channels to the source's means.
std::array<double, 3> scale_to_source(const ViewSums& sums) {
  std::array<double, 3> scale{};
  for (size_t c = 0; c < 3; ++c)
    scale[c] = sums.channels[c].level > 0 ? sums.channels[c].source / sums.channels[c].level : 1.0;
  return scale;
}

void add(AbsoluteSides& sides, const AbsoluteSides& other) {
  sides.raw += other.raw, sides.low += other.low, sides.high += other.high;
  sides.low_variance += other.low_variance, sides.low_null_variance += other.low_null_variance;
}

void add(SquareSum& sum, const SquareSum& other) {
  sum.blocks += other.blocks, sum.value += other.value, sum.variance += other.variance;
  sum.null_variance += other.null_variance;
}

}  // namespace

ViewSums& ViewSums::operator+=(const ViewSums& other) {
  pixels += other.pixels;
  for (size_t c = 0; c < channels.size(); ++c) {
    channels[c].source += other.channels[c].source;
    channels[c].level += other.channels[c].level;
    channels[c].source_variance += other.channels[c].source_variance;
    channels[c].level_variance += other.channels[c].level_variance;
    channels[c].covariance += other.channels[c].covariance;
  }
  for (size_t i = 0; i < kBlockSides.size(); ++i) add(alpha[i], other.alpha[i]), add(color[i], other.color[i]);
  add(sides, other.sides);
  add(rest_sides, other.rest_sides);
  noise += other.noise;
  alpha_raw_square += other.alpha_raw_square;
  return *this;
}

Result<ViewSums> sum_view(Parts source, Parts level) {
  FARFIELD_TRY(check_parts(source, level));
  ViewSums sums;
  sums.pixels = static_cast<double>(source.front().values.size() / 4);
  add_channels(source, level, sums);
  for (size_t i = 0; i < kBlockSides.size(); ++i)
    add_blocks(source, level, kBlockSides[i], sums.alpha[i], sums.color[i]);
  sums.sides = sum_sides(source, level, {1.0, 1.0, 1.0});
  sums.rest_sides = sum_sides(source, level, scale_to_source(sums));
  return sums;
}

}  // namespace farfield
