// SPDX-License-Identifier: Apache-2.0
// Triangles from plane regions with outlines and holes, however they touch or cross.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "base/index.h"
#include "base/vec.h"

namespace farfield {

/// A closed line of indices into points, without the first one repeated at the end.
using Ring = std::vector<Index>;

/// Twice the signed area; positive when counter-clockwise.
double twice_area(std::span<const glm::dvec2> points, std::span<const Index> ring);

/// What is inside.
enum class Winding {
  Positive,  ///< where rings go round counter-clockwise more often than clockwise: outlines with holes
  Nonzero,   ///< where they go round at all: polygons that may cross themselves
};

struct Filling {
  std::vector<glm::dvec2> points;  ///< those given, then one for each crossing
  std::vector<Index> nearest;      ///< for each crossing the given point that weighs most in it
  std::vector<uvec3> triangles;    ///< counter-clockwise, none overlap
};

/// Fills the rings by GLU's sweep line, O(n log n) with the crossings counted in n. All given points on the region's
/// border are corners of triangles, also in the middle of straight edges, so neighbours still fit. Points are finite.
/// Rings of fewer than three points count for nothing. Deterministic; any thread.
Filling fill_rings(std::vector<glm::dvec2> points, std::span<const Ring> rings, Winding winding);

}  // namespace farfield
