// SPDX-License-Identifier: Apache-2.0
// From what voxels are alone to what rays see of them together: densities as hazard rates of long lines, then matched
// until source and medium stop the same lines (docs/decisions/0012).
#pragma once

#include <cstdint>

#include "base/job.h"
#include "base/result.h"
#include "prefilter/line_scene.h"
#include "prefilter/voxelize.h"

namespace farfield {

struct VisibleDensityOptions {
  double lines = 0;   ///< per step; about five times as many in all
  uint64_t seed = 0;  ///< equal seeds give equal lines
  Job job{};          ///< reports from the calling thread alone
};

/// Corrects densities, octants, normals and reflectances of `volume` by what isotropic lines through `scene` see first.
/// What no line reaches keeps its local measurement, scaled like what is near it. No voxel is added or removed. The
/// result does not depend on the number of threads. Errors: Cancelled.
Result<void> match_visible_density(const LineScene& scene, SparseVolume& volume, const VisibleDensityOptions& options);

}  // namespace farfield
