// SPDX-License-Identifier: Apache-2.0
// The bake of a volume (thesis 14.1): level 0 is its grid, level k what blocks of 2^k voxels of that become, up to the
// first that is at most BakeOptions::coarsest_grid voxels long.
#pragma once

#include "bake/bake.h"
#include "bake/bake_workspace.h"
#include "import/source_volume.h"

namespace farfield {

/// Writes all levels of a volume into the workspace and publishes them. `report` has the manifest but for its levels
/// and what depends on them. The result does not depend on the number of threads. Errors: those of bake().
Result<BakeReport> bake_levels(const SourceVolume& volume, const BakeOptions& options, BakeWorkspace workspace,
                               BakeReport report);

}  // namespace farfield
