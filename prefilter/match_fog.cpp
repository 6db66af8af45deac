// SPDX-License-Identifier: Apache-2.0
// The least squares of match_lines.h, where a line is not stopped or let through but let through in part: with A the
// share that the source stops of it, and T what the medium lets through, for each voxel sum d T A = sum d T (1 - T).
#include "prefilter/match_fog.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/hash.h"
#include "base/parallel.h"
#include "prefilter/fixed_sum.h"
#include "prefilter/fog_shape.h"
#include "prefilter/isotropic_lines.h"
#include "prefilter/match_lines.h"
#include "prefilter/voxel_ratios.h"  // SourceAndMedium

namespace farfield {
namespace {

constexpr int kPasses = 5;
constexpr double kLinesPerVoxel = 24;  ///< through each, in each pass
/// How much a block's own density counts against what lines say of it, in units of the sums: inside of thick fog, where
/// no line gets, it is all there is.
constexpr double kPrior = 0.03;
constexpr int kWholePasses = 2;
constexpr size_t kLineSets = 2;     ///< that take turns: the source, which is what takes time, is walked once for each
constexpr double kMostWhole = 0.3;  ///< a step of all densities together changes none by a larger share
constexpr double kFewestLines = 20000, kMostLines = 4e6;
constexpr uint64_t kSeed = 0x666f67;  // "fog"

/// Calls visit(index of the brick, voxel in it, length) for the voxels of the filled bricks along a ray; all in voxels
/// of which `side` make one of the grid's along an edge.
template <typename Visit>
void walk_grid(const DensityGrid& grid, int side, const VoxelRay& ray, const Visit& visit) {
  walk_cells(ray, side * kVolumeBrickSide, ivec3(0), grid.brick_dims, [&](const ivec3& at, double enter, double leave) {
    const uint32_t brick = grid.brick_table[grid.table_index(at)];
    if (brick == kEmptyBrick) return true;
    const ivec3 corner = at * kVolumeBrickSide;
    walk_cells({ray.origin, ray.direction, enter, leave}, side, corner, corner + kVolumeBrickSide,
               [&](const ivec3& voxel, double t, double t_end) {
                 visit(brick, index_in_brick(voxel - corner), t_end - t);
                 return true;
               });
    return true;
  });
}

class FogMatcher {
 public:
  FogMatcher(const DensityGrid& source, uint32_t k, DensityGrid& level, const Job& job)
      : source_(source),
        level_(level),
        side_(1 << k),
        job_(job),
        box_{dvec3(0.0), dvec3(level.dims * side_)},
        known_(level.bricks.size() * kVolumeBrickVoxels, 0.0f),
        local_(level.bricks) {
    const double in_level_voxels = surface_area(box_) / (side_ * static_cast<double>(side_));
    // Of lines through the box, this share goes through a voxel: the ratio of their surfaces.
    lines_ = static_cast<uint64_t>(std::clamp(kLinesPerVoxel * in_level_voxels / 6, kFewestLines, kMostLines));
  }

  Result<void> run() {
    for (int pass = 0; pass < kPasses; ++pass) FARFIELD_TRY(match_voxels());
    for (int pass = 0; pass < kWholePasses; ++pass) FARFIELD_TRY(match_whole());
    return {};
  }

 private:
  /// Optical depth of the source along a ray.
  double source_depth(const VoxelRay& ray) const {
    double depth = 0;
    walk_grid(source_, 1, ray, [&](uint32_t brick, size_t voxel, double length) {
      const float density = source_.bricks[brick][voxel];
      if (density > 0)
        depth += static_cast<double>(density) * length * source_sigma(source_, brick, voxel, ray.direction);
    });
    return depth * source_.voxel_size;
  }

  /// Calls visit(number of the voxel, depth there) for the level's voxels along a ray.
  template <typename Visit>
  void visit_depths(const VoxelRay& ray, const Visit& visit) const {
    walk_grid(level_, side_, ray, [&](uint32_t brick, size_t voxel, double length) {
      const float density = level_.bricks[brick][voxel];
      if (!(density > 0)) return;
      const double depth = static_cast<double>(density) * length * source_.voxel_size;
      visit(brick * kVolumeBrickVoxels + voxel, depth * source_sigma(level_, brick, voxel, ray.direction));
    });
  }

  /// A line and its optical depth in the source, once known.
  struct Line {
    VoxelRay ray;
    float& source_depth;
  };
  double depth_in_source(const Line& line) const {
    if (line.source_depth < 0) line.source_depth = static_cast<float>(source_depth(line.ray));
    return static_cast<double>(line.source_depth);
  }

  /// Calls see(line) for the next set of lines, from many threads. Errors: Cancelled.
  template <typename See>
  Result<void> for_next_lines(const See& see) {
    const size_t set = passes_++ % kLineSets;
    const uint64_t seed = mix64(kSeed, set);
    std::vector<float>& depths = source_depths_[set];
    depths.resize(lines_, -1.0f);
    parallel_for(lines_, 1024, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end && !job_.is_cancelled(); ++i)
        see(Line{isotropic_line(box_, even_coordinates(i, seed)), depths[i]});
    });
    if (job_.is_cancelled()) return make_error(ErrorCode::Cancelled, "bake: cancelled");
    job_.report(static_cast<double>(passes_) / (kPasses + kWholePasses), "match");
    return {};
  }

  Result<void> match_voxels() {
    struct Part {
      size_t number;
      double depth;
    };
    std::vector<SourceAndMedium> sums(level_.bricks.size() * kVolumeBrickVoxels);
    FARFIELD_TRY(for_next_lines([&](const Line& line) {
      thread_local std::vector<Part> parts;
      parts.clear();
      double depth = 0;
      visit_depths(line.ray, [&](size_t number, double of_part) {
        parts.push_back({number, of_part});
        depth += of_part;
      });
      if (parts.empty()) return;
      const double passing = std::exp(-depth), stopped = -std::expm1(-depth);
      const double stopped_by_source = -std::expm1(-depth_in_source(line));
      for (const Part& part : parts) {
        sums[part.number].source.add(part.depth * passing * stopped_by_source);
        sums[part.number].medium.add(part.depth * passing * stopped);
      }
    }));
    for (size_t v = 0; v < sums.size(); ++v) {
      float& density = level_.bricks[v / kVolumeBrickVoxels][v % kVolumeBrickVoxels];
      if (!(density > 0)) continue;
      const double local =
          static_cast<double>(local_[v / kVolumeBrickVoxels][v % kVolumeBrickVoxels]) / static_cast<double>(density);
      const double ratio = (sums[v].source.value() + kPrior * local) / (sums[v].medium.value() + kPrior);
      density = static_cast<float>(static_cast<double>(density) * std::clamp(ratio, 1 / kMostMatch, kMostMatch));
      known_[v] = static_cast<float>(sums[v].medium.value() / (sums[v].medium.value() + kPrior));
    }
    return {};
  }

  /// A Newton step of one exponent for all densities, as far as lines know them, towards as much that is stopped as in
  /// the source: least squares alone leave a bias.
  Result<void> match_whole() {
    FixedSum missing, slope;
    FARFIELD_TRY(for_next_lines([&](const Line& line) {
      double depth = 0, known = 0;
      visit_depths(line.ray, [&](size_t number, double of_part) {
        depth += of_part;
        known += of_part * static_cast<double>(known_[number]);
      });
      missing.add(std::exp(-depth) - std::exp(-depth_in_source(line)));
      slope.add(known * std::exp(-depth));
    }));
    if (!(slope.value() > 0)) return {};
    const double step = std::clamp(missing.value() / slope.value(), -kMostWhole, kMostWhole);
    for (size_t v = 0; v < known_.size(); ++v) {
      float& density = level_.bricks[v / kVolumeBrickVoxels][v % kVolumeBrickVoxels];
      density = static_cast<float>(static_cast<double>(density) * (1 + step * static_cast<double>(known_[v])));
    }
    return {};
  }

  const DensityGrid& source_;
  DensityGrid& level_;
  const int side_;
  const Job& job_;
  const VoxelBox box_;  ///< of the level, in voxels of the source
  uint64_t lines_ = 0;  ///< of each pass
  uint64_t passes_ = 0;
  std::array<std::vector<float>, kLineSets> source_depths_;  ///< by line; below 0: not known yet
  std::vector<float> known_;               ///< of each voxel: what lines say of it against what its block says
  const std::vector<DensityBrick> local_;  ///< densities of the blocks alone
};

}  // namespace

Result<void> match_fog(const DensityGrid& source, uint32_t k, DensityGrid& level, const Job& job) {
  if (level.bricks.empty()) return {};
  return FogMatcher(source, k, level, job).run();
}

}  // namespace farfield
