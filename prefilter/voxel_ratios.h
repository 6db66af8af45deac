// SPDX-License-Identifier: Apache-2.0
// Per voxel, how much of something the geometry has by how much of it the medium has, from few rays.
#pragma once

#include <cstddef>
#include <vector>

#include "prefilter/fixed_sum.h"
#include "prefilter/voxelize.h"

namespace farfield {

/// Sums of one voxel. Any thread may add.
struct SourceAndMedium {
  FixedSum source, medium;
};

/// source / medium of each voxel. A voxel about which rays say little takes the ratio of its brick, and a brick that of
/// the whole volume: each level counts `prior` of the next one's, in units of the sums, > 0. Positive and finite.
std::vector<double> shrunk_ratios(const SparseVolume& volume, const std::vector<SourceAndMedium>& sums, double prior);

}  // namespace farfield
