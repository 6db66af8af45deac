// SPDX-License-Identifier: Apache-2.0
// The volume of a level: all steps from its geometry to the voxels that are stored.
#pragma once

#include <cstdint>

#include "base/job.h"
#include "base/result.h"
#include "prefilter/surface.h"
#include "prefilter/voxelize.h"

namespace farfield {

struct VolumeOptions {
  uint32_t rays_per_voxel = 200;  ///< > 0: half of them for the voxel alone, the rest in about four steps
  uint64_t seed = 0;
  Job job{};  ///< reports from the calling thread alone
};

/// Voxelises `geometry` locally, matches densities, normals and reflectances with what long lines see of it before the
/// macrosurface, measures self-shadowing, and thins out faint voxels. `macrosurface` is what the level shows as it is,
/// in the same space; it may be empty. The result does not depend on the number of threads. Errors: those of
/// voxelize().
Result<SparseVolume> measure_volume(const Surface& geometry, const Surface& macrosurface, const VoxelLattice& lattice,
                                    const VolumeOptions& options);

}  // namespace farfield
