// SPDX-License-Identifier: Apache-2.0
// Where rays meet a level first, against where they meet its source: coverage and colour of a picture can be right
// while the depth of a crown is not (docs/error_metric.md, "Depth").
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "evaluate/estimate.h"
#include "evaluate/views.h"

namespace farfield {

class AssetView;

/// Rays are counted in this many independent batches; figures come from products of different ones.
inline constexpr size_t kDepthBatches = 16;
/// Distributions of depth are compared at this many depths.
inline constexpr size_t kDepthBins = 512;

/// First hits of one set of rays, as fractions of the source's longest side.
struct DepthFigures {
  Estimate mean;     ///< mean depth in the level - in the source, of rays that hit
  Bounded distance;  ///< earth mover's: how far hits must be moved to turn one distribution into the other
};

struct DepthAgreement {
  DepthFigures camera;   ///< along camera rays: mean over the views
  DepthFigures inside;   ///< rays in all directions from points in the source's bounds
  Estimate inside_hits;  ///< (level - source) / source of the share of those that hit
};

/// Where the hits of a set of rays lie, in batches.
class DepthHistogram {
 public:
  /// distance: of ray number `ray` in [0, range), else a miss. Ray i belongs to batch i % kDepthBatches.
  void add(size_t ray, float distance, float range);
  double hits(size_t batch) const { return hits_[batch]; }
  /// Mean depth over range of a batch's hits; 0 without any.
  double mean(size_t batch) const;
  /// Share of a batch's hits up to each depth.
  std::array<double, kDepthBins> cumulative(size_t batch) const;

 private:
  std::array<std::array<double, kDepthBins>, kDepthBatches> counts_{};
  std::array<double, kDepthBatches> hits_{}, sums_{};
};

struct DepthPair {
  DepthHistogram source, level;
  double range_over_size = 1;  ///< what a depth of 1 is in the figures' unit
};
/// The figures over some sets of rays, each with the same weight. Sets without hits on both sides in every batch are
/// left out; without any others nothing is known.
DepthFigures compare_depths(std::span<const DepthPair> sets);

/// Traces the same rays into source and level. The job is polled for each set of rays. Errors: Cancelled.
Result<DepthAgreement> measure_depths(const AssetView& source, const AssetView& level, std::span<const OrthoView> views,
                                      const Box3& source_bounds, uint64_t seed, const Job& job);

}  // namespace farfield
