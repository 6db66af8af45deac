// SPDX-License-Identifier: Apache-2.0
// Fog as a level file holds it: brick by brick, so that nothing of a level is in memory but what its file will hold.
#pragma once

#include <functional>

#include "base/big_vector.h"
#include "base/job.h"
#include "base/result.h"
#include "cache/level.h"
#include "prefilter/downsample_fog.h"

namespace farfield {

/// A level whose arrays may be larger than memory.
struct FogLevel : LevelArrays<BigVector> {
  LevelHeader header;
};

/// The level of a source as it is: level 0. Densities become bytes per brick; what rounding takes from a voxel the
/// next ones along x get back, so that sums along rays stay. A voxel of less than half a step may become empty.
/// header.level is 0. Errors: Cancelled.
Result<FogLevel> pack_source_fog(const SourceVolume& source, const Job& job = {});

/// Level k >= 1 of a source: what FogDownsampler makes. Channels whose values are all the default are left out. The
/// result does not depend on the number of threads. Errors: Cancelled.
Result<FogLevel> pack_fog(const SourceVolume& source, uint32_t level, Downsampling method, const Job& job = {});

}  // namespace farfield
