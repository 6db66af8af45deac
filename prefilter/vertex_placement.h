// SPDX-License-Identifier: Apache-2.0
// Where the vertex of a collapsed edge goes: the two-sided closest point optimisation of thesis 8.2.2.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "base/vec.h"

namespace farfield {

/// The surface around an edge before and after its collapse into a vertex x. All lengths in scene units.
struct CollapseRing {
  std::vector<std::array<dvec3, 3>> before;  ///< triangles at either end of the edge, wound alike
  std::vector<std::array<dvec3, 2>> after;   ///< triangles that stay: x and these two corners, wound as before
  std::vector<dvec3> samples_before;         ///< points of the surface before: edge ends, middles of the edges at them
  std::vector<dvec3> neighbours_after;       ///< vertices that share an edge with x

  void clear();
};

/// x may move along point + t * direction only.
struct PlacementLine {
  dvec3 point, direction;
};

struct Placement {
  dvec3 position;
  double deviation;  ///< largest distance from a sample of one surface to the other
};

/// Moves x from `start` so that the sum of squared distances between samples of each surface and the other surface
/// falls, until it moves by less than `tolerance` [eq. 8.2.2]. The sum never grows. Pure function.
Placement place_vertex(const CollapseRing& ring, const dvec3& start, const std::optional<PlacementLine>& line,
                       double tolerance);

/// Moves x along the mean normal, at most until the surface encloses the same volume as before, so that its area stays
/// as near as possible to the area before: the optimum above lies a little inside of curved surfaces, and level by
/// level they would shrink; with the same volume they would grow. Equal area means that random lines cross the surface
/// equally often (Cauchy, Crofton). Only for edges away from borders. Where the volume hardly depends on x (folds of
/// thin sheets), x hardly moves.
dvec3 restore_area(const CollapseRing& ring, const dvec3& x);

/// The same measure for an x that is given.
Placement keep_vertex(const CollapseRing& ring, const dvec3& position);

/// Where x may lie so that the border ... p, a, b, q ... encloses the same area as ... p, x, q ...: a line parallel to
/// pq. Nothing where p and q are so near to each other that there is none.
std::optional<PlacementLine> area_preserving_line(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& q);

/// The weights (each in [0, 1], sum 1) of the corners in the triangle's point that is nearest to p. Degenerate
/// triangles are treated as their longest edge.
dvec3 closest_barycentric(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c);

}  // namespace farfield
