// SPDX-License-Identifier: Apache-2.0
// Shapes inside voxels: which octants hold a voxel's density (docs/decisions/0016).
#pragma once

#include "base/result.h"
#include "prefilter/line_scene.h"
#include "prefilter/voxelize.h"

namespace farfield {

/// Gives each voxel's density to the octants that geometry passes through, by what `lines.lines` lines in all see, and
/// rounds them to the shares that are stored. The voxels' own densities, which become those of their densest octants,
/// want to be matched again. The result does not depend on the number of threads. Errors: Cancelled.
Result<void> measure_octants(const LineScene& scene, SparseVolume& volume, const LinePass& lines);

}  // namespace farfield
