// SPDX-License-Identifier: Apache-2.0
#include "prefilter/thin_out.h"

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "prefilter/density.h"

namespace farfield {
namespace {

/// Mean optical depth over the voxel's side, by which its mean transmittance is exp(-depth).
double mean_depth(const Voxel& voxel, double size) {
  return -std::log1p(-mean_opacity(voxel.sggx, voxel.density * mean_share(voxel.octants), size));
}

/// Whether a voxel is so dense that its depth need not be computed: R_G is at least half of sqrt(lambda_max) = 1, and
/// a depth of 0.02 is nearly linear in it.
bool is_surely_kept(const Voxel& voxel, double size) {
  return voxel.density * mean_share(voxel.octants) * size > 2.5 * kFaintestDepth;
}

float densest(const SparseVolume& volume, uint64_t first, const VoxelMask& mask) {
  float density = 0;
  for (const uint64_t word : mask) {
    for (int i = __builtin_popcountll(word); i > 0; --i) density = std::max(density, volume.voxels[first++].density);
  }
  return density;
}

/// Thins out one brick. What voxels that go had is passed on to the next ones in the brick until it is enough for one:
/// their sum is kept up to one voxel, so that few voxels are no lottery.
class BrickThinner {
 public:
  BrickThinner(double size, float densest, double start) : size_(size), step_(densest / 255), owed_(start) {}

  /// The voxel as it is stored; density 0: not at all.
  Voxel thinned(Voxel voxel) {
    const double share = std::min(kept_share(voxel, size_), static_cast<double>(voxel.density / step_));
    if (share >= 1) return voxel;
    owed_ += share;
    const bool is_kept = owed_ >= 1;
    if (is_kept) owed_ -= 1;
    voxel.density = is_kept ? static_cast<float>(voxel.density / share) : 0.0f;
    return voxel;
  }

 private:
  double size_;
  float step_;   ///< of the densities that the brick stores
  double owed_;  ///< in voxels
};

}  // namespace

double kept_share(const Voxel& voxel, double size) {
  return is_surely_kept(voxel, size) ? 1 : std::min(1.0, mean_depth(voxel, size) / kFaintestDepth);
}

SparseVolume thin_out(const SparseVolume& volume, uint64_t seed) {
  SparseVolume result;
  result.lattice = volume.lattice;
  result.hot_spot = volume.hot_spot;
  result.highlight_lean = volume.highlight_lean;
  result.open_side = volume.open_side;
  for (VoxelBrick brick : volume.bricks) {
    uint64_t next = brick.first_voxel;
    brick.first_voxel = result.voxels.size();
    BrickThinner thinner(volume.lattice.voxel_size, densest(volume, next, brick.mask),
                         to_unit_float(seed_of(brick.coordinate, seed)));
    for (int i = 0; i < kBrickVoxels; ++i) {
      uint64_t& word = brick.mask[static_cast<size_t>(i >> 6)];
      const uint64_t bit = uint64_t{1} << (i & 63);
      if (!(word & bit)) continue;
      const Voxel voxel = thinner.thinned(volume.voxels[next++]);
      if (voxel.density > 0) {
        result.voxels.push_back(voxel);
      } else {
        word &= ~bit;
      }
    }
    if (result.voxels.size() > brick.first_voxel) result.bricks.push_back(brick);
  }
  return result;
}

}  // namespace farfield
