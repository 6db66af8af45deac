// SPDX-License-Identifier: Apache-2.0
// The source as a surface of one material per face that still shows what is as large as a level's resolution: faces are
// cut along alpha masks, and split where their material varies (docs/decisions/0011).
#pragma once

#include <cstdint>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "prefilter/source_surface.h"
#include "prefilter/surface.h"

namespace farfield {

struct ResolvedSurface {
  Surface surface;
  std::vector<uint32_t> vertex_of;  ///< per vertex of the source; kNoIndex: no face of it is left
  std::vector<uint32_t> face_of;    ///< per triangle of the source: its largest part, or kNoIndex if nothing is left
};

/// Cuts and splits. Alpha masks become outlines; faces that blend keep their opacity, those of opacity 0 go. What
/// varies (is_varied) is bisected across its longest edge, together with its neighbour there, until no edge is longer
/// than `resolution` (scene units, > 0): no cracks, no T-junctions, no needles that were not there. The result does not
/// depend on the number of threads. Errors: Cancelled; BadFile (nothing is left).
Result<ResolvedSurface> resolve(const SourceSurface& source, float resolution, const Job& job = {});

/// About how many faces resolve() would give, from the area of what varies: for a decision, in a fraction of the time.
/// Too few when cancelled.
uint64_t estimate_resolved_faces(const SourceSurface& source, float resolution, const Job& job = {});

}  // namespace farfield
