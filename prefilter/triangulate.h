// SPDX-License-Identifier: Apache-2.0
// Triangles from the polygons of a mesh: quads along the better diagonal, larger ones by a sweep line.
#pragma once

#include <span>
#include <vector>

#include "base/vec.h"

namespace farfield {

/// Cuts the polygon with these corners (in order, not necessarily plane or convex) into corner-index triples; all use
/// the polygon's winding. Three corners give one triangle; four are cut along the diagonal that lies inside, and where
/// both do along the shorter one (the pair shares corners 0 and 2, or 1 and 3); more are projected along their mean
/// normal and filled in double, O(n log n). Fewer than three or non-finite corners give nothing.
std::vector<uvec3> triangulate_polygon(std::span<const dvec3> corners);

}  // namespace farfield
