// SPDX-License-Identifier: Apache-2.0
// A voxel's density is a hazard rate. Along a ray that nothing has stopped yet the chance to be stopped in the next
// step is density times step, so that the most likely density for H hits after a length L in the voxel is H / L. Rays
// are long and only first hits count, as for cameras and lights: what is hidden, and the second side of a twig, count
// nothing.
//
// Clumped geometry lets more through than a medium of its densities. So both are compared line by line (match_lines.h),
// and what a voxel's geometry leaves empty becomes empty octants (octants.h).
#include "prefilter/visible_density.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/hash.h"
#include "prefilter/density.h"
#include "prefilter/fixed_sum.h"
#include "prefilter/match_lines.h"
#include "prefilter/octants.h"
#include "prefilter/seen_sums.h"

namespace farfield {
namespace {

constexpr double kPriorHits = 2;  ///< hits that a voxel's own measurement counts as, against what lines see of it
constexpr int kMatchPasses = 4;
constexpr double kMostWhole = 2;

/// Lines of each step, as a multiple of options.lines.
constexpr double kHazardLines = 1, kOctantLines = 2, kMatchLines = 0.5, kFirstWholeLines = 0.25, kWholeLines = 0.5;
constexpr double kAllLines = kHazardLines + kOctantLines + kMatchLines + kFirstWholeLines + kWholeLines;

class DensityMatcher {
 public:
  DensityMatcher(const LineScene& scene, SparseVolume& volume, const VisibleDensityOptions& options)
      : scene_(scene), volume_(volume), options_(options) {}

  Result<void> run() {
    FARFIELD_TRY(measure_hazard(next_pass(kHazardLines)));
    FARFIELD_TRY(measure_octants(scene_, volume_, next_pass(kOctantLines)));
    for (int i = 0; i < kMatchPasses; ++i) FARFIELD_TRY(match_voxels(next_pass(kMatchLines / kMatchPasses)));
    // Only the last of these must be exact.
    FARFIELD_TRY(match_whole(next_pass(kFirstWholeLines)));
    FARFIELD_TRY(match_whole(next_pass(kWholeLines)));
    return {};
  }

 private:
  /// The hits that were seen by the hits that the local densities make one expect.
  Result<void> measure_hazard(const LinePass& pass) {
    std::vector<SourceAndMedium> hits(volume_.voxels.size());
    std::vector<SeenSums> seen(volume_.voxels.size());
    FARFIELD_TRY(for_lines(scene_, pass, [&](const SeenLine& line, SplitMix&) {
      VoxelRay exposed = line.ray;
      exposed.far = line.seen_until();
      visit_depths(volume_, scene_.grid(), exposed, [&](uint32_t v, double depth) { hits[v].medium.add(depth); });
      if (!line.hit) return;
      const auto v = scene_.voxel_of_hit(line);
      if (!v) return;
      hits[*v].source.add(1);
      seen[*v].add_hit(scene_.geometry().materials[line.hit->triangle]);
    }));
    const std::vector<double> ratios = shrunk_ratios(volume_, hits, kPriorHits);
    for (size_t v = 0; v < ratios.size(); ++v) {
      scale(ratios[v], volume_.voxels[v]);
      seen[v].apply(kPriorHits, volume_.voxels[v]);
    }
    return {};
  }

  /// One step towards the least squares of match_lines.h.
  Result<void> match_voxels(const LinePass& pass) {
    FARFIELD_TRY_LET(const auto sums,
                     match_lines(scene_, volume_.voxels.size(), pass, [&](const VoxelRay& ray, const auto& visit) {
                       visit_depths(volume_, scene_.grid(), ray, visit);
                     }));
    const std::vector<double> ratios = shrunk_ratios(volume_, sums, kPriorMatch);
    for (size_t v = 0; v < ratios.size(); ++v) {
      scale(std::clamp(ratios[v], 1 / kMostMatch, kMostMatch), volume_.voxels[v]);
    }
    return {};
  }

  /// A Newton step of one factor for all densities, towards as many stopped lines as the source's: least squares alone
  /// leave a bias.
  Result<void> match_whole(const LinePass& pass) {
    FixedSum missing, slope;
    FARFIELD_TRY(for_lines(scene_, pass, [&](const SeenLine& line, SplitMix&) {
      const double depth = optical_depth(volume_, scene_.grid(), line.ray);
      missing.add((line.hit ? 1 : 0) + std::expm1(-depth));
      slope.add(depth * std::exp(-depth));
    }));
    if (!(slope.value() > 0)) return {};
    const double ratio = std::clamp(1 + missing.value() / slope.value(), 1 / kMostWhole, kMostWhole);
    for (Voxel& voxel : volume_.voxels) scale(ratio, voxel);
    return {};
  }

  void scale(double ratio, Voxel& voxel) const {
    const double most = kMaxDensityLength / volume_.lattice.voxel_size;
    voxel.density = static_cast<float>(std::min(static_cast<double>(voxel.density) * ratio, most));
  }

  /// The next lines, this share of options.lines; all different from those of other passes.
  LinePass next_pass(double share) {
    const double begin = done_;
    done_ += share / kAllLines;
    return {share * options_.lines, mix64(options_.seed, passes_++), options_.job.step("see", begin, done_)};
  }

  const LineScene& scene_;
  SparseVolume& volume_;
  const VisibleDensityOptions& options_;
  double done_ = 0;      ///< of all lines
  uint64_t passes_ = 0;  ///< that were begun
};

}  // namespace

Result<void> match_visible_density(const LineScene& scene, SparseVolume& volume, const VisibleDensityOptions& options) {
  if (volume.voxels.empty()) return {};
  return DensityMatcher(scene, volume, options).run();
}

}  // namespace farfield
