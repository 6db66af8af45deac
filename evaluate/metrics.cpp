// SPDX-License-Identifier: Apache-2.0
// Noise. With D = level - source per pixel and channel, known only as d + noise, sum |D| over-estimates sum |d|. The
// parts give a second estimate from the other side: the sign of d is taken from all parts but one, the value from the
// one left out. They are independent, so E[D_j sign(D_-j)] = d E[sign(D_-j)] <= |d|, and it is exactly 0 where d = 0.
// For Gaussian d and noise, E[|D_-j|] E[D_j sign(D_-j)] = (2 / pi) var(d) = E[|d|]^2: the geometric mean of the two
// sums is what is reported. It is exact, too, where noise is small.
#include "evaluate/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "base/parallel.h"
#include "base/result.h"

namespace farfield {
namespace {

constexpr size_t kMaxParts = 16;

/// The difference of one pixel and channel in every part of a subset, and what the sums need of it.
class PartDifferences {
 public:
  void add(double difference) {
    FARFIELD_ASSERT(count_ < kMaxParts);
    values_[count_++] = difference;
    sum_ += difference;
    squares_ += difference * difference;
  }
  double mean() const { return sum_ / static_cast<double>(count_); }
  /// Unbiased estimate of the squared difference.
  double product() const {
    const double n = static_cast<double>(count_);
    return (sum_ * sum_ - squares_) / (n * (n - 1.0));
  }
  /// |difference| bounded from both sides, see the top of the file: means over the parts j.
  struct Bounds {
    double low = 0;   ///< of D_j sign(D_-j)
    double high = 0;  ///< of |D_-j|
  };
  Bounds bounds() const {
    Bounds total;
    for (size_t j = 0; j < count_; ++j) {
      const double others = sum_ - values_[j];
      total.low += others > 0 ? values_[j] : (others < 0 ? -values_[j] : 0.0);
      total.high += std::abs(others);
    }
    const double n = static_cast<double>(count_);
    return {total.low / n, total.high / (n * (n - 1.0))};
  }
  /// A combination of the parts that has the noise of the mean and none of the difference.
  double noise() const {
    const size_t paired = count_ / 2 * 2;
    double alternating = 0;
    for (size_t j = 0; j < paired; ++j) alternating += j % 2 == 0 ? values_[j] : -values_[j];
    return alternating / std::sqrt(static_cast<double>(count_ * paired));
  }

 private:
  std::array<double, kMaxParts> values_;
  size_t count_ = 0;
  double sum_ = 0, squares_ = 0;
};

double ratio(double numerator, double denominator) {
  if (denominator > 0) return numerator / denominator;
  return numerator == 0 ? 0.0 : std::copysign(std::numeric_limits<double>::infinity(), numerator);
}

/// Jackknife over left-out parts: whole is f(all parts), partial[j] is f(all but part j).
Estimate jackknife(double whole, std::span<const double> partial) {
  const double n = static_cast<double>(partial.size());
  double mean = 0, squares = 0;
  for (const double value : partial) mean += value / n;
  for (const double value : partial) squares += (value - mean) * (value - mean);
  return {whole, std::sqrt(squares * (n - 1.0) / n)};
}

Result<void> check_parts(std::span<const Image> source, std::span<const Image> level) {
  if (source.size() != level.size() || source.size() < 3 || source.size() > kMaxParts)
    return make_error(ErrorCode::InvalidArgument, "source and level need the same number of parts, 3 to 16");
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

}  // namespace

/// Adds what one view says, from all parts but `left_out` (parts.size(): from all).
void ErrorAccumulator::add_subset(std::span<const Image> source, std::span<const Image> level, size_t left_out,
                                  Sums& sums) {
  std::vector<size_t> used;
  for (size_t part = 0; part < source.size(); ++part)
    if (part != left_out) used.push_back(part);
  const double weight = 1.0 / static_cast<double>(used.size());
  const size_t values = source.front().values.size();  // R, G, B, A of each pixel

  std::array<double, 4> view_source{}, view_level{};
  for (size_t i = 0; i < values; ++i) {
    const size_t channel = i % 4;
    PartDifferences difference;
    for (const size_t part : used) {
      const double s = source[part].values[i], l = level[part].values[i];
      view_source[channel] += s * weight;
      view_level[channel] += l * weight;
      difference.add(l - s);
    }
    if (channel == 3) {
      sums.alpha_squares += difference.mean() * difference.mean();
      sums.alpha_products += difference.product();
    } else {
      const PartDifferences::Bounds bounds = difference.bounds();
      sums.raw += std::abs(difference.mean());
      sums.low += bounds.low;
      sums.high += bounds.high;
      sums.noise += std::abs(difference.noise());
    }
  }

  // Second pass: the same with each channel of the level scaled to the source's mean in this view.
  std::array<double, 4> scale{};
  for (size_t c = 0; c < 4; ++c) scale[c] = view_level[c] > 0 ? view_source[c] / view_level[c] : 1.0;
  for (size_t i = 0; i < values; ++i) {
    if (i % 4 == 3) continue;
    PartDifferences rest;
    for (const size_t part : used) rest.add(scale[i % 4] * level[part].values[i] - source[part].values[i]);
    const PartDifferences::Bounds bounds = rest.bounds();
    sums.rest_low += bounds.low;
    sums.rest_high += bounds.high;
  }

  sums.pixels += static_cast<double>(values / 4);
  for (size_t c = 0; c < 4; ++c) sums.source[c] += view_source[c], sums.level[c] += view_level[c];
}

Result<void> ErrorAccumulator::add_view(std::span<const Image> source, std::span<const Image> level) {
  FARFIELD_TRY(check_parts(source, level));
  if (!sums_.empty() && sums_.size() != source.size() + 1)
    return make_error(ErrorCode::InvalidArgument, "every view needs the same number of parts");
  sums_.resize(source.size() + 1);
  parallel_for(sums_.size(), 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) add_subset(source, level, i == 0 ? source.size() : i - 1, sums_[i]);
  });
  return {};
}

/// The errors as the sums of one subset give them, without standard errors.
ErrorMetrics ErrorAccumulator::evaluate(const Sums& sums) {
  const double light = sums.source[0] + sums.source[1] + sums.source[2];
  ErrorMetrics m;
  m.occlusion_error.value = ratio(sums.level[3] - sums.source[3], sums.source[3]);
  m.occlusion_rms.value = std::sqrt(std::max(0.0, ratio(sums.alpha_products, sums.pixels)));
  m.occlusion_rms_raw = std::sqrt(ratio(sums.alpha_squares, sums.pixels));
  m.color_error.value = ratio(std::sqrt(sums.high * std::max(0.0, sums.low)), light);
  m.color_error_raw = ratio(sums.raw, light);
  m.color_error_low = ratio(sums.low, light);
  m.color_noise = ratio(sums.noise, light);
  for (size_t c = 0; c < 3; ++c) m.color_bias[c].value = ratio(sums.level[c] - sums.source[c], sums.source[c]);
  m.color_rest.value = ratio(std::sqrt(sums.rest_high * std::max(0.0, sums.rest_low)), light);
  return m;
}

ErrorMetrics ErrorAccumulator::metrics() const {
  if (sums_.empty()) return {};
  ErrorMetrics whole = evaluate(sums_[0]);
  std::vector<ErrorMetrics> partial;
  for (size_t part = 1; part < sums_.size(); ++part) partial.push_back(evaluate(sums_[part]));

  // Sets the standard error of the estimate that `get` picks.
  const auto set_error = [&](auto get) {
    std::vector<double> values;
    for (ErrorMetrics& metrics : partial) values.push_back(get(metrics).value);
    get(whole) = jackknife(get(whole).value, values);
  };
  set_error([](ErrorMetrics& m) -> Estimate& { return m.occlusion_error; });
  set_error([](ErrorMetrics& m) -> Estimate& { return m.occlusion_rms; });
  set_error([](ErrorMetrics& m) -> Estimate& { return m.color_error; });
  set_error([](ErrorMetrics& m) -> Estimate& { return m.color_rest; });
  for (size_t c = 0; c < 3; ++c) set_error([c](ErrorMetrics& m) -> Estimate& { return m.color_bias[c]; });
  return whole;
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
