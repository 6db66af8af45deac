// SPDX-License-Identifier: Apache-2.0
#include "evaluate/trade_figures.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/nonfinite.h"
#include "base/result.h"

namespace farfield {
namespace {

constexpr size_t kRgba = 4;

bool touches(std::span<const Image> parts, size_t pixel) {
  return std::ranges::any_of(parts, [&](const Image& part) {
    return kRgba * pixel + 3 < part.values.size() && part.values[kRgba * pixel + 3] > 0;
  });
}

/// Noise of one part over all pixels, in the unit of color_rms squared: see mean_square() in metrics.cpp.
double relative_variance(const ViewSums& sums, double ChannelSum::*variance) {
  double noise = 0, light = 0;
  for (size_t c = 0; c < 3; ++c) {
    noise += sums.channels[c].*variance * static_cast<double>(kParts);  // of a part, where the sum is of their mean
    light += sums.channels[c].source;
  }
  const double values = 3.0 * sums.color[0].blocks;
  return light > 0 ? noise * values / (light * light) : 0.0;
}

NoisyErrors errors_of(const ViewSums& sums) {
  return {metrics_of(sums), relative_variance(sums, &ChannelSum::level_variance),
          relative_variance(sums, &ChannelSum::source_variance)};
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

/// Of a frame over the parts that have it.
double median_of(std::span<const RenderReport> parts, int frame,
                 const std::function<double(const FrameReport&)>& figure) {
  std::vector<double> values;
  for (const RenderReport& part : parts)
    for (const FrameReport& report : part.frames)
      if (report.frame == frame) values.push_back(figure(report));
  return median(std::move(values));
}

/// a - b of two independent sizes, which may be below 0.
Bounded less(const Bounded& a, const Bounded& b) {
  Bounded difference;
  difference.low = a.low - b.high, difference.high = a.high - b.low;
  if (!a.value || !b.value) return difference;
  difference.value = *a.value - *b.value;
  difference.standard_error = std::hypot(a.standard_error, b.standard_error);
  return difference;
}

}  // namespace

void hide_background(std::span<Image> source, std::span<Image> level) {
  if (source.empty()) return;
  for (size_t pixel = 0; kRgba * pixel < source.front().values.size(); ++pixel) {
    if (touches(source, pixel) || touches(level, pixel)) continue;
    for (const auto& parts : {source, level})
      for (Image& part : parts)
        if (kRgba * (pixel + 1) <= part.values.size()) std::fill_n(&part.values[kRgba * pixel], kRgba, 0.0f);
  }
}

Result<void> TradeErrorSums::add_frame(FrameParts full, FrameParts setting) {
  hide_background(full, setting);
  FARFIELD_TRY_LET(const auto sums, sum_view(full, setting));
  frames_.push_back(errors_of(sums));
  sums_ += sums;
  return {};
}

TradeErrors TradeErrorSums::errors() const { return {errors_of(sums_), frames_}; }

Result<Bounded> change_between(FrameParts a, FrameParts b) {
  hide_background(a, b);
  FARFIELD_TRY_LET(const auto sums, sum_view(a, b));
  return metrics_of(sums).color_error;
}

ShotPop pop_of(std::span<const Bounded> setting, std::span<const Bounded> full, std::span<const int> frames) {
  ShotPop pop;
  for (size_t i = 0; i < std::min(setting.size(), full.size()); ++i) pop.all.push_back(less(setting[i], full[i]));
  if (pop.all.empty()) return pop;
  // What is known best of the most: where the middle between the bounds is highest, unless a value says more.
  const auto size = [](const Bounded& pair) { return pair.value ? *pair.value : 0.5 * (pair.low + pair.high); };
  const auto most = std::ranges::max_element(pop.all, {}, size);
  const auto index = static_cast<size_t>(most - pop.all.begin());
  if (index + 1 < frames.size()) pop.at = {frames[index], frames[index + 1]};
  pop.most = *most;
  for (const Bounded& pair : pop.all) {
    pop.most.low = std::max(pop.most.low, pair.low);
    pop.most.high = std::max(pop.most.high, pair.high);
    if (!pair.value && pop.most.value && pair.high > *pop.most.value) pop.most.value.reset();  // it may be the most
  }
  return pop;
}

TradeCost cost_of(std::span<const RenderReport> parts, std::span<const int> frames) {
  TradeCost cost;
  for (const int frame : frames) {
    cost.frame_cpu_seconds.push_back(median_of(parts, frame, [](const FrameReport& f) { return f.cpu_seconds; }));
    cost.cpu_seconds += cost.frame_cpu_seconds.back();
    cost.seconds += median_of(parts, frame, [](const FrameReport& f) { return f.seconds; });
    cost.load_seconds += median_of(parts, frame, [](const FrameReport& f) { return f.load_seconds; });
    cost.rays += median_of(parts, frame, [](const FrameReport& f) { return static_cast<double>(f.rays); });
  }
  for (const RenderReport& part : parts) {
    cost.peak_accounted_bytes = std::max(cost.peak_accounted_bytes, part.peak_accounted_bytes);
    cost.peak_rss_bytes =
        std::max(cost.peak_rss_bytes, part.peak_rss_bytes - std::min(part.peak_rss_bytes, part.baseline_rss_bytes));
  }
  return cost;
}

TimeRatio time_to_equal_error(double cpu_ratio, const NoisyErrors& errors) {
  if (!(errors.full_variance > 0)) return {std::nullopt, 0, kInfinity};  // no noise to be equal to
  // Full detail's squared error at n samples is v / n; the setting's is e^2 + v' / n'. They are equal for
  // n' / n = v' / (v - e^2), n = 1 being the samples that were rendered.
  const auto time = [&](double own_error) {
    const double left_for_noise = errors.full_variance - own_error * own_error;
    return left_for_noise > 0 ? cpu_ratio * errors.variance / left_for_noise : kInfinity;
  };
  const Bounded& error = errors.color_rms[0];
  TimeRatio result{std::nullopt, time(error.low), time(error.high)};
  if (error.value) result.value = time(*error.value);
  return result;
}

}  // namespace farfield
