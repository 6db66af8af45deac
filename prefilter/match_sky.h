// SPDX-License-Identifier: Apache-2.0
// The last correction of a volume's albedos: light of all bounces (docs/decisions/0041).
#pragma once

#include <cstdint>

#include "base/job.h"
#include "base/result.h"
#include "prefilter/line_scene.h"
#include "prefilter/voxelize.h"

namespace farfield {

struct MatchSkyOptions {
  uint64_t seed = 0;
  Job job{};  ///< reports from the calling thread alone
};

/// Multiplies the odds of the albedos of all voxels, channel by channel, so that under a constant sky a hit on the
/// medium is as bright in the mean as a hit on the geometry: by paths from what isotropic lines see first, until they
/// are out of both or have met the macrosurface, which counts as black for both. White stays white. The result does not
/// depend on the number of threads. Errors: Cancelled.
Result<void> match_sky(const LineScene& scene, SparseVolume& volume, const MatchSkyOptions& options);

}  // namespace farfield
