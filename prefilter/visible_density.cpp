// SPDX-License-Identifier: Apache-2.0
// A voxel's density is a hazard rate. Along a ray that nothing has stopped yet the chance to be stopped in the next
// step is density times step, so that the most likely density for H hits after a length L in the voxel is H / L. Rays
// are long and only first hits count, as for cameras and lights: what is hidden, and the second side of a twig, count
// nothing.
//
// Clumped geometry lets more through than a medium of its densities. So both are compared line by line. Let A be 1 for
// a line that the geometry stops, T what the medium lets through of it, and d its depth in one voxel. The sum of
// squares of A - (1 - T) is least where for each voxel
//
//    sum d T A  =  sum d T (1 - T),
//
// and the ratio of the two sides says by how much its density is wrong. Expected hits per voxel, which would make every
// voxel right as seen from outside, blur silhouettes and empty the inside (measured in docs/decisions/0012).
#include "prefilter/visible_density.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/hash.h"
#include "prefilter/density.h"
#include "prefilter/fixed_sum.h"
#include "prefilter/seen_sums.h"
#include "prefilter/voxel_ratios.h"

namespace farfield {
namespace {

constexpr double kPriorHits = 2;   ///< hits that a voxel's own measurement counts as, against what lines see of it
constexpr double kPriorMatch = 1;  ///< the same for matching, in units of sum d T A
constexpr int kMatchPasses = 8;
constexpr double kMostMatch = 1.5;  ///< a pass changes a density by no larger factor
constexpr double kMostWhole = 2;

/// All lines, as a multiple of options.lines, for the progress.
constexpr double kAllLines = 2.75;

class DensityMatcher {
 public:
  DensityMatcher(const LineScene& scene, SparseVolume& volume, const VisibleDensityOptions& options)
      : scene_(scene), volume_(volume), options_(options) {}

  Result<void> run() {
    FARFIELD_TRY(measure_hazard(pass(0, 1)));
    for (uint64_t i = 0; i < kMatchPasses; ++i) FARFIELD_TRY(match_voxels(pass(1 + i, 1.0 / kMatchPasses)));
    // Only the last of these must be exact.
    FARFIELD_TRY(match_whole(pass(kMatchPasses + 1, 0.25)));
    FARFIELD_TRY(match_whole(pass(kMatchPasses + 2, 0.5)));
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

  /// One step towards the least squares of the file's first comment.
  Result<void> match_voxels(const LinePass& pass) {
    struct Part {
      uint32_t voxel;
      double depth;
    };
    std::vector<SourceAndMedium> sums(volume_.voxels.size());
    FARFIELD_TRY(for_lines(scene_, pass, [&](const SeenLine& line, SplitMix&) {
      thread_local std::vector<Part> parts;
      parts.clear();
      double depth = 0;
      visit_depths(volume_, scene_.grid(), line.ray, [&](uint32_t v, double of_voxel) {
        parts.push_back({v, of_voxel});
        depth += of_voxel;
      });
      const double passing = std::exp(-depth), stopped = -std::expm1(-depth);
      for (const Part& part : parts) {
        if (line.hit) sums[part.voxel].source.add(part.depth * passing);
        sums[part.voxel].medium.add(part.depth * passing * stopped);
      }
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
  LinePass pass(uint64_t number, double share) {
    const double begin = done_;
    done_ += share / kAllLines;
    return {share * options_.lines, mix64(options_.seed, number), options_.job.step("see", begin, done_)};
  }

  const LineScene& scene_;
  SparseVolume& volume_;
  const VisibleDensityOptions& options_;
  double done_ = 0;  ///< of all lines
};

}  // namespace

Result<void> match_visible_density(const LineScene& scene, SparseVolume& volume, const VisibleDensityOptions& options) {
  if (volume.voxels.empty()) return {};
  return DensityMatcher(scene, volume, options).run();
}

}  // namespace farfield
