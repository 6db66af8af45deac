// SPDX-License-Identifier: Apache-2.0
// Edge collapse: the half of simplification that works on all triangles (thesis 8.1 to 8.3).
#pragma once

#include <cstdint>
#include <span>

#include "base/job.h"
#include "prefilter/simplify.h"

namespace farfield {

/// Where the vertex of a collapsed edge goes, away from borders' ends.
enum class VertexPlacement {
  EqualArea,      ///< between the two below, where the area stays: docs/decisions/0004
  EqualVolume,    ///< where the volume stays (at borders: the area that they enclose)
  ClosestPoints,  ///< where the distance is least (thesis 8.2.2)
};

struct EdgeCollapseOptions {
  double resolution = 0;              ///< r_k in scene units. <= 0: nothing collapses
  std::span<const uint8_t> is_fixed;  ///< per face: none of its corners moves or merges. Empty: none is
  std::span<const float> deviation;   ///< per vertex: how far the surface there may be from the input already. Empty: 0
  std::span<const uint8_t> is_pinned = {};  ///< per vertex: stays where it is; others may merge into it. Empty: none
  VertexPlacement placement = VertexPlacement::EqualArea;  ///< others are for comparisons
};

/// Collapses edges, shortest first, until they are about half the resolution long, as simplify() says.
SimplifyResult collapse_edges(const Surface& surface, const EdgeCollapseOptions& options, const Job& job = {});

}  // namespace farfield
