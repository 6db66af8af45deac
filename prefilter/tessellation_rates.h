// SPDX-License-Identifier: Apache-2.0
// Into how many parts the edges and the insides of a cage's faces are cut, so that flat faces look as the limit
// surface.
#pragma once

#include <array>
#include <vector>

#include "base/job.h"
#include "prefilter/face_heights.h"
#include "prefilter/limit_surface.h"

namespace farfield {

/// What a tessellation may be off, in the cage's units.
struct TessellationLimits {
  double error = 0;   ///< farthest distance from the limit surface, > 0
  double edge = 0;    ///< longest edge; 0: none
  double detail = 0;  ///< of displaced faces: what heights are means over, > 0
};

/// Edges have one rate, whichever of their faces looks: that is why there are no cracks.
struct TessellationRates {
  std::vector<int> edge;                   ///< per edge of the cage, >= 1
  std::vector<std::array<int, 2>> inside;  ///< per face, >= 1: of quads along u and v, of triangles twice the same
};

/// The most that an edge is cut into: a guard, reached by nothing that fits into memory.
inline constexpr int kMostRate = 4096;

/// The smallest rates (but for rounding) that keep within the limits of the surface, with its heights. The same for any
/// number of threads. After a cancel of no use.
TessellationRates find_rates(const LimitSurface& surface, const FaceHeights& heights, const TessellationLimits& limits,
                             const Job& job = {});

}  // namespace farfield
