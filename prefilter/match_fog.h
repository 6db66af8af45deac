// SPDX-License-Identifier: Apache-2.0
// Densities of a coarse level of fog that let through, along whole lines, what the source lets through: what is right
// for each block alone is wrong for many in a row, where they are clumped or cut by the volume's border
// (docs/decisions/0012 and 0026).
#pragma once

#include "base/job.h"
#include "base/result.h"
#include "import/source_volume.h"

namespace farfield {

/// Changes the densities of `level`, whose voxels are 2^k of the source's along each axis and start where those do;
/// none that is 0. Lines are followed through one region after the other, layers of bricks of about region_bytes, so
/// that no more of either grid is in memory at a time than that. The result depends neither on that nor on the number
/// of threads. Errors: Cancelled.
Result<void> match_fog(const DensityGrid& source, uint32_t k, DensityGrid& level, const Job& job,
                       uint64_t region_bytes = uint64_t{192} << 20);

}  // namespace farfield
