// SPDX-License-Identifier: Apache-2.0
// The earth mover's distance of two distributions on a line is the integral of |F_level - F_source|, F the cumulative
// ones: a sum of absolute values of noisy differences again, which batches bound from both sides as in metrics.cpp.
#include "evaluate/depth.h"

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "base/random.h"
#include "base/result.h"
#include "path_tracer/asset_view.h"

namespace farfield {
namespace {

constexpr double kBatchCount = kDepthBatches;
constexpr size_t kRaysPerView = size_t{1} << 15;
constexpr size_t kInsideRays = size_t{1} << 17;

using Batches = std::array<double, kDepthBatches>;

Estimate mean_of(const Batches& values) {
  double mean = 0, squares = 0;
  for (const double value : values) mean += value / kBatchCount;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {mean, std::sqrt(squares / (kBatchCount * (kBatchCount - 1.0)))};
}

/// Sums over the sets: what each batch says of the mean and of the distance.
struct DepthSums {
  Batches mean{}, low{};
  double high = 0, raw = 0;
};

bool has_hits_everywhere(const DepthPair& set) {
  for (size_t batch = 0; batch < kDepthBatches; ++batch)
    if (!(set.source.hits(batch) > 0 && set.level.hits(batch) > 0)) return false;
  return true;
}

void add_set(const DepthPair& set, DepthSums& sums) {
  std::array<std::array<double, kDepthBins>, kDepthBatches> differences;
  for (size_t batch = 0; batch < kDepthBatches; ++batch) {
    const auto source = set.source.cumulative(batch), level = set.level.cumulative(batch);
    for (size_t bin = 0; bin < kDepthBins; ++bin) differences[batch][bin] = level[bin] - source[bin];
    sums.mean[batch] += set.range_over_size * (set.level.mean(batch) - set.source.mean(batch));
  }
  const double width = set.range_over_size / static_cast<double>(kDepthBins);
  for (size_t bin = 0; bin < kDepthBins; ++bin) {
    double all = 0;
    for (const auto& batch : differences) all += batch[bin];
    sums.raw += width * std::abs(all / kBatchCount);
    for (size_t batch = 0; batch < kDepthBatches; ++batch) {
      const double value = differences[batch][bin], others = all - value;
      sums.low[batch] += width * with_sign_of_others(value, others);
      sums.high += width * std::abs(others) / (kBatchCount * (kBatchCount - 1.0));
    }
  }
}

ProbeRay camera_ray(const OrthoView& view, float distance, Rng& rng) {
  const float x = (rng.next() - 0.5f) * view.width();
  const float y = (rng.next() - 0.5f) * view.pixel_size * static_cast<float>(view.height_px);
  return {view.center + x * view.right() + y * view.up - distance * view.direction, view.direction};
}

ProbeRay inside_ray(const Box3& bounds, Rng& rng) {
  const float x = rng.next(), y = rng.next(), z = rng.next();
  const float cosine = 1.0f - 2.0f * rng.next(), phi = 2.0f * kPi * rng.next();
  const float sine = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
  return {bounds.lower + vec3(x, y, z) * bounds.size(), {sine * std::cos(phi), cosine, sine * std::sin(phi)}};
}

/// range: no hit is farther.
DepthPair trace_both(const AssetView& source, const AssetView& level, const std::vector<ProbeRay>& rays, float range,
                     float size, uint64_t seed) {
  DepthPair pair;
  pair.range_over_size = static_cast<double>(range / size);
  const std::vector<float> in_source = source.first_hits(rays, seed), in_level = level.first_hits(rays, mix64(seed, 1));
  for (size_t ray = 0; ray < rays.size(); ++ray) {
    pair.source.add(ray, in_source[ray], range);
    pair.level.add(ray, in_level[ray], range);
  }
  return pair;
}

Estimate relative_hits(const DepthPair& pair) {
  Batches errors{};
  for (size_t batch = 0; batch < kDepthBatches; ++batch) {
    const double source = pair.source.hits(batch);
    errors[batch] = source > 0 ? (pair.level.hits(batch) - source) / source : 0.0;
  }
  return mean_of(errors);
}

}  // namespace

void DepthHistogram::add(size_t ray, float distance, float range) {
  if (!(distance >= 0 && distance < range)) return;
  const size_t batch = ray % kDepthBatches;
  const double depth = static_cast<double>(distance) / static_cast<double>(range);
  const auto bin = static_cast<size_t>(depth * static_cast<double>(kDepthBins));
  counts_[batch][std::min(bin, kDepthBins - 1)] += 1;
  hits_[batch] += 1;
  sums_[batch] += depth;
}

double DepthHistogram::mean(size_t batch) const { return hits_[batch] > 0 ? sums_[batch] / hits_[batch] : 0.0; }

std::array<double, kDepthBins> DepthHistogram::cumulative(size_t batch) const {
  std::array<double, kDepthBins> shares{};
  double count = 0;
  for (size_t bin = 0; bin < kDepthBins; ++bin) {
    count += counts_[batch][bin];
    shares[bin] = hits_[batch] > 0 ? count / hits_[batch] : 0.0;
  }
  return shares;
}

DepthFigures compare_depths(std::span<const DepthPair> sets) {
  DepthSums sums;
  double count = 0;
  for (const DepthPair& set : sets) {
    if (!has_hits_everywhere(set)) continue;
    add_set(set, sums);
    count += 1;
  }
  if (count == 0) return {{}, {std::nullopt, 0.0, 1.0, 0.0}};
  for (size_t batch = 0; batch < kDepthBatches; ++batch) sums.mean[batch] /= count, sums.low[batch] /= count;
  DepthFigures figures;
  figures.mean = mean_of(sums.mean);
  const Estimate floor = {std::abs(figures.mean.value), figures.mean.standard_error};
  figures.distance =
      absolute_of({{mean_of(sums.low), 0.0}, sums.high / count, sums.raw / count, sums.raw / count, floor});
  return figures;
}

Result<DepthAgreement> measure_depths(const AssetView& source, const AssetView& level, std::span<const OrthoView> views,
                                      const Box3& source_bounds, uint64_t seed, const Job& job) {
  const float size = max_component(source_bounds.size());
  std::vector<DepthPair> sets;
  for (size_t i = 0; i < views.size(); ++i) {
    if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
    // From outside of everything that the picture shows.
    const OrthoView& view = views[i];
    const float reach = glm::length(source_bounds.size()) +
                        view.pixel_size * static_cast<float>(std::max(view.width_px, view.height_px));
    Rng rng(mix64(seed, i));
    std::vector<ProbeRay> rays(kRaysPerView);
    for (ProbeRay& ray : rays) ray = camera_ray(view, reach, rng);
    sets.push_back(trace_both(source, level, rays, 2.0f * reach, size, mix64(seed, i)));
  }
  if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  Rng rng(mix64(seed, views.size()));
  std::vector<ProbeRay> rays(kInsideRays);
  for (ProbeRay& ray : rays) ray = inside_ray(source_bounds, rng);
  const float diagonal = glm::length(source_bounds.size());
  const DepthPair inside = trace_both(source, level, rays, 2.0f * diagonal, size, mix64(seed, views.size()));
  return DepthAgreement{compare_depths(sets), compare_depths({&inside, 1}), relative_hits(inside)};
}

}  // namespace farfield
