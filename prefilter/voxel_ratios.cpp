// SPDX-License-Identifier: Apache-2.0
#include "prefilter/voxel_ratios.h"

namespace farfield {
namespace {

struct Ratio {
  double source = 0, medium = 0;

  void add(const SourceAndMedium& sums) { source += sums.source.value(), medium += sums.medium.value(); }
  double shrunk(double towards, double prior) const { return (source + prior * towards) / (medium + prior); }
};

}  // namespace

std::vector<double> shrunk_ratios(const SparseVolume& volume, const std::vector<SourceAndMedium>& sums, double prior) {
  Ratio whole;
  for (const SourceAndMedium& of_voxel : sums) whole.add(of_voxel);
  const double whole_ratio = whole.shrunk(1, prior);

  std::vector<double> ratios;
  ratios.reserve(sums.size());
  for (const VoxelBrick& brick : volume.bricks) {
    const size_t first = brick.first_voxel, last = first + voxel_count(brick.mask);
    Ratio in_brick;
    for (size_t v = first; v < last; ++v) in_brick.add(sums[v]);
    const double brick_ratio = in_brick.shrunk(whole_ratio, prior);
    for (size_t v = first; v < last; ++v) {
      Ratio of_voxel;
      of_voxel.add(sums[v]);
      ratios.push_back(of_voxel.shrunk(brick_ratio, prior));
    }
  }
  return ratios;
}

}  // namespace farfield
