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
#include "prefilter/layer_walk.h"
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

/// Calls visit(index of the brick, voxel in it, length) for the voxels of the filled bricks in these layers of bricks
/// along a ray that goes upwards; all in voxels of which `side` make one of the grid's along an edge.
template <typename Visit>
void walk_grid(const DensityGrid& grid, int side, const LayerRange& layers, const VoxelRay& ray, const Visit& visit) {
  walk_layers(ray, side * kVolumeBrickSide, grid.brick_dims, layers, [&](const ivec3& at, double enter, double leave) {
    const uint32_t brick = grid.brick_table[grid.table_index(at)];
    if (brick == kEmptyBrick) return;
    const ivec3 corner = at * kVolumeBrickSide;
    walk_cells({ray.origin, ray.direction, enter, leave}, side, corner, corner + kVolumeBrickSide,
               [&](const ivec3& voxel, double t, double t_end) {
                 visit(brick, index_in_brick(voxel - corner), t_end - t);
                 return true;
               });
  });
}

/// The grid's layers of bricks, as many in a row as take about region_bytes; at least one.
std::vector<LayerRange> regions_of(const DensityGrid& grid, uint64_t bytes_per_brick, uint64_t region_bytes) {
  const size_t in_layer = static_cast<size_t>(grid.brick_dims.x) * static_cast<size_t>(grid.brick_dims.y);
  std::vector<LayerRange> regions = {{0, 0}};
  uint64_t bytes = 0;
  for (int z = 0; z < grid.brick_dims.z; ++z) {
    const auto first = grid.brick_table.begin() + static_cast<std::ptrdiff_t>(static_cast<size_t>(z) * in_layer);
    const auto empty = std::count(first, first + static_cast<std::ptrdiff_t>(in_layer), kEmptyBrick);
    const uint64_t of_layer = bytes_per_brick * (in_layer - static_cast<size_t>(empty));
    if (bytes > 0 && bytes + of_layer > region_bytes) {
      regions.push_back({z, z});
      bytes = 0;
    }
    bytes += of_layer;
    regions.back().end = z + 1;
  }
  return regions;
}

uint64_t bytes_of_brick(const DensityGrid& grid) {
  return sizeof(DensityBrick) + (grid.shapes.empty() ? 0 : sizeof(ShapeBrick));
}

class FogMatcher {
 public:
  FogMatcher(const DensityGrid& source, uint32_t k, DensityGrid& level, const Job& job, uint64_t region_bytes)
      : source_(source),
        level_(level),
        side_(1 << k),
        job_(job),
        box_{dvec3(0.0), dvec3(level.dims * side_)},
        source_regions_(regions_of(source, bytes_of_brick(source), region_bytes)),
        level_regions_(
            regions_of(level, bytes_of_brick(level) + kVolumeBrickVoxels * sizeof(SourceAndMedium), region_bytes)),
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
  /// Calls see(number of the line, ray) for all lines of a set, from many threads. Errors: Cancelled.
  template <typename See>
  Result<void> for_lines(size_t set, const See& see) const {
    const uint64_t seed = mix64(kSeed, set);
    parallel_for(lines_, 1024, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end && !job_.is_cancelled(); ++i)
        see(i, upwards(isotropic_line(box_, even_coordinates(i, seed))));
    });
    if (job_.is_cancelled()) return make_error(ErrorCode::Cancelled, "bake: cancelled");
    return {};
  }

  /// The set of lines of the next pass; its depths in the source are known then.
  Result<size_t> next_lines() {
    job_.report(static_cast<double>(passes_) / (kPasses + kWholePasses), "match");
    const size_t set = passes_++ % kLineSets;
    if (!source_depths_[set].empty()) return set;
    std::vector<double> depths(lines_, 0.0);
    for (const LayerRange& region : source_regions_) {
      FARFIELD_TRY(for_lines(set, [&](size_t i, const VoxelRay& ray) { add_source_depth(ray, region, depths[i]); }));
      if (is_much_in_memory()) rest(source_);
    }
    source_depths_[set].assign(depths.begin(), depths.end());
    return set;
  }

  void add_source_depth(const VoxelRay& ray, const LayerRange& region, double& depth) const {
    walk_grid(source_, 1, region, ray, [&](uint32_t brick, size_t voxel, double length) {
      const auto density = static_cast<double>(source_.bricks[brick][voxel]);
      if (density > 0)
        depth += density * source_.voxel_size * length * source_sigma(source_, brick, voxel, ray.direction);
    });
  }

  /// Calls visit(number of the voxel, depth there) for the level's voxels along a ray.
  template <typename Visit>
  void visit_depths(const VoxelRay& ray, const LayerRange& region, const Visit& visit) const {
    walk_grid(level_, side_, region, ray, [&](uint32_t brick, size_t voxel, double length) {
      const float density = level_.bricks[brick][voxel];
      if (!(density > 0)) return;
      const double depth = static_cast<double>(density) * length * source_.voxel_size;
      visit(brick * kVolumeBrickVoxels + voxel, depth * source_sigma(level_, brick, voxel, ray.direction));
    });
  }

  void rest_level() const {
    if (!is_much_in_memory()) return;
    rest(level_);
    rest(known_);
    rest(local_);
  }

  /// What the level stops of each line, and how much of that lines know.
  struct LineDepth {
    double all = 0, known = 0;
  };
  Result<std::vector<LineDepth>> level_depths(size_t set) const {
    std::vector<LineDepth> depths(lines_);
    for (const LayerRange& region : level_regions_) {
      FARFIELD_TRY(for_lines(set, [&](size_t i, const VoxelRay& ray) {
        visit_depths(ray, region, [&](size_t number, double of_part) {
          depths[i].all += of_part;
          depths[i].known += of_part * static_cast<double>(known_[number]);
        });
      }));
      rest_level();
    }
    return depths;
  }

  Result<void> match_voxels() {
    struct Part {
      size_t number;
      double depth;
    };
    FARFIELD_TRY_LET(const size_t set, next_lines());
    std::vector<LineDepth> depths;  // in one region a line's parts come all at once, and say it
    if (level_regions_.size() > 1) {
      FARFIELD_TRY_LET(depths, level_depths(set));
    }
    BigVector<SourceAndMedium> sums(level_.bricks.size() * kVolumeBrickVoxels);
    for (const LayerRange& region : level_regions_) {
      FARFIELD_TRY(for_lines(set, [&](size_t i, const VoxelRay& ray) {
        thread_local std::vector<Part> parts;
        parts.clear();
        double depth = 0;
        visit_depths(ray, region, [&](size_t number, double of_part) {
          parts.push_back({number, of_part});
          depth += of_part;
        });
        if (parts.empty()) return;
        if (!depths.empty()) depth = depths[i].all;
        const double passing = std::exp(-depth), stopped = -std::expm1(-depth);
        const double stopped_by_source = -std::expm1(-static_cast<double>(source_depths_[set][i]));
        for (const Part& part : parts) {
          sums[part.number].source.add(part.depth * passing * stopped_by_source);
          sums[part.number].medium.add(part.depth * passing * stopped);
        }
      }));
      rest_level();
      if (is_much_in_memory()) rest(sums);
    }
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
    FARFIELD_TRY_LET(const size_t set, next_lines());
    FARFIELD_TRY_LET(const auto depths, level_depths(set));
    FixedSum missing, slope;
    for (size_t i = 0; i < depths.size(); ++i) {
      const double passing = std::exp(-depths[i].all);
      missing.add(passing - std::exp(-static_cast<double>(source_depths_[set][i])));
      slope.add(depths[i].known * passing);
    }
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
  const std::vector<LayerRange> source_regions_, level_regions_;
  uint64_t lines_ = 0;  ///< of each pass
  uint64_t passes_ = 0;
  std::array<std::vector<float>, kLineSets> source_depths_;  ///< by line; empty: not known yet
  BigVector<float> known_;               ///< of each voxel: what lines say of it against what its block says
  const BigVector<DensityBrick> local_;  ///< densities of the blocks alone
};

}  // namespace

Result<void> match_fog(const DensityGrid& source, uint32_t k, DensityGrid& level, const Job& job,
                       uint64_t region_bytes) {
  if (level.bricks.empty()) return {};
  return FogMatcher(source, k, level, job, region_bytes).run();
}

}  // namespace farfield
