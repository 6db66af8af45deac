// SPDX-License-Identifier: Apache-2.0
// A grid whose voxels are no cubes, on cubes: what levels are made of looks alike from all sides.
#pragma once

#include <string>

#include "base/job.h"
#include "base/result.h"
#include "import/source_volume.h"
#include "import/voxel_shape.h"

namespace farfield {

/// `stretched`: a volume whose voxel (i, j, k) is not a cube but the image of that unit cube under shape.edges, in the
/// frame of its rotation. Returns it on cubes of shape.size from the lower corner of what has a density: each has the
/// mean density over 4^3 points of it (exact where edges are along the axes and multiples of the cubes'), then all are
/// scaled by one number, so that the sum of density times volume, and with it the mean optical depth along any
/// direction, is the source's. What voxels have besides is weighted by density: of ellipsoids the mean matrix, as they
/// are where they stand; octants of flakes are left out. Where all around is the same, bricks are shared. The result
/// does not depend on the number of threads. Its warnings are the source's. Errors: Unsupported (too many or too far
/// apart), Cancelled; without the source's name.
Result<SourceVolume> resample_to_cubes(const SourceVolume& stretched, const VoxelShape& shape, const Job& job = {});

/// "voxels are 2 x 1 x 1: resampled onto cubes of 1".
std::string resampling_text(const VoxelShape& shape);

}  // namespace farfield
