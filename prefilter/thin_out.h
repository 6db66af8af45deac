// SPDX-License-Identifier: Apache-2.0
// Volumes without the many voxels that hardly anything is in.
#pragma once

#include <cstdint>

#include "prefilter/voxelize.h"

namespace farfield {

/// Mean optical depth over a voxel's side below which voxels are thinned out.
inline constexpr double kFaintestDepth = 0.02;

/// How many of voxels like this one, of this size, are kept: at most 1, the depth by kFaintestDepth.
double kept_share(const Voxel& voxel, double size);

/// Of the voxels fainter than kFaintestDepth, or than the steps in which their brick stores densities, keeps a share
/// only, as much denser, so that nothing is lost. Depends on the volume and the seed alone.
SparseVolume thin_out(const SparseVolume& volume, uint64_t seed);

}  // namespace farfield
