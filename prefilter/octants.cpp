// SPDX-License-Identifier: Apache-2.0
#include "prefilter/octants.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <vector>

#include "base/hash.h"
#include "base/parallel.h"
#include "prefilter/density.h"
#include "prefilter/grid_cells.h"
#include "prefilter/match_lines.h"
#include "prefilter/triangle_pieces.h"

namespace farfield {
namespace {

// Early passes only lead the way; the last ones decide.
constexpr int kPasses = 12;
constexpr double kPassGrowth = 1.3;
// Optical depth of an octant from side to side that is as good as opaque: more would only make the shares of the others
// in its voxel too small to store.
constexpr double kOpaqueDepth = 4;

/// Whether the plane of a piece cuts the cell.
bool meets_plane(const TrianglePiece& t, const ivec3& cell) {
  const dvec3 normal = area_vector_of(t);
  const double distance = glm::dot(normal, dvec3(cell) + 0.5 - t[0]);
  return std::abs(distance) <= 0.5 * (std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z)) * (1 + 1e-9);
}

/// The octants of each voxel that triangles pass through, as bits; all where none does.
std::vector<uint8_t> touched_octants(const LineScene& scene, size_t voxels) {
  const Surface& geometry = scene.geometry();
  std::vector<uint8_t> touched(voxels, 0);
  const auto touch = [&](const ivec3& octant) {
    if (const auto voxel = scene.grid().find(octant >> 1)) {
      const ivec3 bit = octant & 1;
      std::atomic_ref(touched[*voxel])
          .fetch_or(static_cast<uint8_t>(1 << (bit.x + 2 * bit.y + 4 * bit.z)), std::memory_order_relaxed);
    }
  };
  parallel_for(geometry.triangles.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const auto in_octants = in_cells(corners_of(geometry, i), scene.lattice().origin, scene.lattice().voxel_size / 2);
      for_each_piece(in_octants, 1, [&](const TrianglePiece& t) {
        const CellRange octants = cells_of(t);
        for_each_cell(octants.first, octants.last, [&](const ivec3& octant) {
          if (meets_plane(t, octant)) touch(octant);
        });
      });
    }
  });
  for (uint8_t& octants : touched) {
    if (octants == 0) octants = 0xff;
  }
  return touched;
}

class OctantMatcher {
 public:
  OctantMatcher(const LineScene& scene, SparseVolume& volume) : scene_(scene), volume_(volume) {
    touched_ = touched_octants(scene, volume.voxels.size());
    first_.reserve(touched_.size());
    for (size_t v = 0; v < touched_.size(); ++v) {
      const auto count = static_cast<double>(octant_count(v));
      const double density = volume.voxels[v].density;
      most_.push_back(std::max(density, 2 * kOpaqueDepth / volume.lattice.voxel_size));
      first_.push_back(static_cast<uint32_t>(density_.size()));
      density_.insert(density_.end(), octant_count(v), std::min(8 / count * density, most_.back()));
    }
  }

  /// One step towards the least squares of match_lines.h.
  Result<void> match(const LinePass& pass) {
    FARFIELD_TRY_LET(const auto sums,
                     match_lines(scene_, density_.size(), pass,
                                 [&](const VoxelRay& ray, const auto& visit) { visit_octant_depths(ray, visit); }));
    for (size_t v = 0; v < touched_.size(); ++v) {
      for (size_t i = first_[v]; i < first_[v] + octant_count(v); ++i) {
        const double ratio = (sums[i].source.value() + kPriorMatch) / (sums[i].medium.value() + kPriorMatch);
        density_[i] = std::min(density_[i] * std::clamp(ratio, 1 / kMostMatch, kMostMatch), most_[v]);
      }
    }
    return {};
  }

  void store_shares() const {
    for (size_t v = 0; v < touched_.size(); ++v) {
      Voxel& voxel = volume_.voxels[v];
      const double* of_octant = &density_[first_[v]];
      const double most = *std::max_element(of_octant, of_octant + octant_count(v));
      voxel.density = static_cast<float>(most);
      voxel.octants = 0;
      for (int o = 0; o < 8; ++o) {
        if (touched_[v] >> o & 1)
          voxel.octants |= static_cast<PackedOctants>(nearest_share(*of_octant++ / most) << 2 * o);
      }
    }
  }

 private:
  size_t octant_count(size_t voxel) const { return static_cast<size_t>(__builtin_popcount(touched_[voxel])); }

  template <typename Visit>
  void visit_octant_depths(const VoxelRay& ray, const Visit& visit) const {
    const vec3 direction(ray.direction);
    walk_octants(scene_.grid(), ray, [&](const OctantStretch& at) {
      const unsigned touched = touched_[at.voxel], bit = 1u << at.octant;
      if (!(touched & bit)) return true;
      const uint32_t number = first_[at.voxel] + static_cast<uint32_t>(__builtin_popcount(touched & (bit - 1)));
      const double length = (at.leave - at.enter) * volume_.lattice.voxel_size;
      visit(number, length * density_[number] * projected_area(volume_.voxels[at.voxel], direction));
      return true;
    });
  }

  static int nearest_share(double share) {
    const auto nearest = std::min_element(kOctantShares.begin(), kOctantShares.end(), [&](double a, double b) {
      return std::abs(a - share) < std::abs(b - share);
    });
    return static_cast<int>(nearest - kOctantShares.begin());
  }

  const LineScene& scene_;
  SparseVolume& volume_;
  std::vector<uint8_t> touched_;  ///< octants of each voxel, as bits
  std::vector<uint32_t> first_;   ///< of each voxel: number of its first touched octant
  std::vector<double> most_;      ///< of each voxel's octants' densities
  std::vector<double> density_;   ///< of touched octants
};

}  // namespace

Result<void> measure_octants(const LineScene& scene, SparseVolume& volume, const LinePass& lines) {
  OctantMatcher matcher(scene, volume);
  const auto share_up_to = [](int pass) {
    return (std::pow(kPassGrowth, pass) - 1) / (std::pow(kPassGrowth, kPasses) - 1);
  };
  for (int i = 0; i < kPasses; ++i) {
    const double done = share_up_to(i), next = share_up_to(i + 1);
    FARFIELD_TRY(matcher.match(
        {lines.lines * (next - done), mix64(lines.seed, static_cast<uint64_t>(i)), lines.job.step("see", done, next)}));
  }
  matcher.store_shares();
  return {};
}

}  // namespace farfield
