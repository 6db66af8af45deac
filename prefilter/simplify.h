// SPDX-License-Identifier: Apache-2.0
// Resolution-based simplification of macrosurfaces with filtered materials (thesis 8.1 to 8.3).
#pragma once

#include <cstdint>
#include <vector>

#include "base/job.h"
#include "prefilter/surface.h"

namespace farfield {

struct SimplifyOptions {
  float resolution = 0;  ///< r_k in scene units; collapsing stops at edges of about half of it. <= 0: nothing collapses
};

/// A simplified surface and where everything went; kMorphVoxelized and kMorphCollapsed are in cache/level.h.
struct SimplifyResult {
  Surface surface;
  std::vector<uint32_t> vertex_map;  ///< input vertex -> output vertex; kMorphVoxelized if no input face uses it
  std::vector<uint32_t> face_map;    ///< input face -> output face, or kMorphCollapsed
};

/// Collapses edges, shortest first, until they are about half the resolution long, and filters the materials of the
/// faces around each collapse so that their area-weighted mean stays (8.3.8). Output faces keep the order, the winding
/// and the corner order of the input faces that they come from; output vertices are those used by faces.
///
/// What stays: topology (link condition), so a manifold stays one; borders and non-manifold edges, which collapse only
/// along themselves; the orientation of every face; the area enclosed by a plane border; and the distance to the
/// input, up to a fraction of the resolution. A collapse that would break one of these is not made: simplification
/// never fails, it stops earlier; so it does once the job is cancelled. Deterministic for any thread count;
/// thread-safe.
SimplifyResult simplify(const Surface& macrosurface, const SimplifyOptions& options, const Job& job = {});

}  // namespace farfield
