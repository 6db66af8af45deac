// SPDX-License-Identifier: Apache-2.0
// Where the vertex of a collapsed edge goes: the two-sided closest point optimisation of thesis 8.2.2.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "base/vec.h"
#include "prefilter/collapse_limits.h"

namespace farfield {

/// A triangle and a ball around it, in scene units: searches pass it over where a point is too far from the ball.
struct BoundedTriangle {
  Corners corners;
  dvec3 center;
  double radius;

  BoundedTriangle(const dvec3& a, const dvec3& b, const dvec3& c);
};

/// The surface around an edge before and after its collapse into a vertex x. All lengths in scene units.
struct CollapseRing {
  std::vector<BoundedTriangle> before;      ///< triangles at either end of the edge, wound alike
  std::vector<std::array<dvec3, 2>> after;  ///< triangles that stay: x and these two corners, wound as before
  std::vector<dvec3> samples_before;        ///< points of the surface before: edge ends, middles of the edges at them
  std::vector<dvec3> neighbours_after;      ///< vertices that share an edge with x

  void clear();
};

/// Where x goes from `start` so that the sum of squared distances between samples of each surface and the other
/// surface falls, until it moves by less than `tolerance` [Loubet 2018, eq. 8.2.2]. The sum never grows. `start` if
/// there is no face before or none after. Pure function.
dvec3 closest_position(const CollapseRing& ring, const dvec3& start, double tolerance);

/// The largest distance from a sample of one surface to the other, with this x; infinite if one has no
/// face. Pure function.
double deviation_at(const CollapseRing& ring, const dvec3& x);

/// The point between `from` and `to` where the area after the collapse is nearest to the area before. The optimum above
/// lies a little inside of curved surfaces, and level by level they would shrink; with the same volume, or the same
/// area within a tube's end, they would grow. Equal area means that random lines cross the surface equally often
/// (Cauchy, Crofton), so silhouettes stay.
dvec3 restore_area(const CollapseRing& ring, const dvec3& from, const dvec3& to);

/// x, moved along the mean normal until the surface encloses the same volume as before. For edges away from borders.
/// Where the volume hardly depends on x (folds of thin sheets), x hardly moves.
dvec3 with_same_volume(const CollapseRing& ring, const dvec3& x);

/// x, moved so that the border ... p, x, q ... encloses the same area as ... p, a, b, q ...: perpendicularly to pq.
/// Nothing where p and q are so near to each other that there is no such place nearby.
std::optional<dvec3> with_same_border_area(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& q,
                                           const dvec3& x);

/// The weights (each in [0, 1], sum 1) of the corners in the triangle's point that is nearest to p. Degenerate
/// triangles are treated as their longest edge.
dvec3 closest_barycentric(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c);

}  // namespace farfield
