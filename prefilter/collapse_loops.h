// SPDX-License-Identifier: Apache-2.0
// Face-loop collapse: a strip of quads becomes a line, and quads stay quads (thesis 8.4).
#pragma once

#include <vector>

#include "base/job.h"
#include "prefilter/simplify.h"

namespace farfield {

struct LoopCollapseResult {
  SimplifyResult simplified;
  std::vector<float> deviation;  ///< per vertex of the result: bound of the distance to the input around it
};

/// Collapses the face loops of the surface's quads, cheapest first (distance to the input and width, both against the
/// resolution), each by merging one of its sides into the other: into the one that costs less. Loops end at borders and
/// at triangles, which collapse with them. Materials mix within the few faces that take the place of a quad (8.4.4).
///
/// What stays is what simplify() says. A loop that would break it stays as it is, as do loops that have no side to
/// collapse to: that lie beside themselves with both sides alike, or are twisted. Deterministic for any thread count;
/// thread-safe.
LoopCollapseResult collapse_loops(const Surface& surface, double resolution, const Job& job = {});

}  // namespace farfield
