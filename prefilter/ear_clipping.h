// SPDX-License-Identifier: Apache-2.0
// Triangles from plane polygons, concave or with holes.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "base/vec.h"

namespace farfield {

/// A ring of indices into `points`, without the first one repeated at the end.
using Ring = std::vector<uint32_t>;

/// Twice the signed area; positive when counter-clockwise.
double twice_area(std::span<const glm::dvec2> points, std::span<const uint32_t> ring);

/// Cuts a counter-clockwise ring into ring.size() - 2 triangles (indices into `points`, counter-clockwise) by ear
/// clipping; vertices in the middle of straight edges stay corners of triangles. Bridged holes (join_holes) may touch
/// themselves. A ring that crosses itself still ends, in triangles that overlap. Triangles without area may come out
/// where the ring has none. O(n * reflex vertices).
std::vector<uvec3> clip_ears(std::span<const glm::dvec2> points, std::span<const uint32_t> ring);

/// One ring from an outer (counter-clockwise) and its holes (clockwise): each hole is joined by a bridge that is walked
/// once in each direction [Eberly 1998].
Ring join_holes(std::span<const glm::dvec2> points, Ring outer, std::vector<Ring> holes);

}  // namespace farfield
