// SPDX-License-Identifier: Apache-2.0
// Triangles in pieces that are small against the cells of a grid.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "base/vec.h"
#include "prefilter/surface.h"

namespace farfield {

using TrianglePiece = std::array<dvec3, 3>;

/// Halves a triangle across its longest edge until no edge is longer than `longest` (> 0), and visits the pieces.
template <typename Visit>
void for_each_piece(const TrianglePiece& t, double longest, Visit&& visit) {
  const auto length2 = [&](size_t c) {
    const dvec3 edge = t[(c + 1) % 3] - t[c];
    return glm::dot(edge, edge);
  };
  size_t cut = 0;
  for (size_t c = 1; c < 3; ++c) {
    if (length2(c) > length2(cut)) cut = c;
  }
  if (!(length2(cut) > longest * longest)) return visit(t);
  const dvec3 &from = t[cut], &to = t[(cut + 1) % 3], &apex = t[(cut + 2) % 3];
  const dvec3 middle = 0.5 * (from + to);
  for_each_piece({apex, from, middle}, longest, visit);
  for_each_piece({apex, middle, to}, longest, visit);
}

inline TrianglePiece corners_of(const Surface& surface, const uvec3& t) {
  return {dvec3(surface.positions[t.x]), dvec3(surface.positions[t.y]), dvec3(surface.positions[t.z])};
}
inline TrianglePiece corners_of(const Surface& surface, size_t face) {
  return corners_of(surface, surface.triangles[face]);
}

/// In cells of this side, from `origin`.
inline TrianglePiece in_cells(const TrianglePiece& t, const dvec3& origin, double side) {
  return {(t[0] - origin) / side, (t[1] - origin) / side, (t[2] - origin) / side};
}

inline dvec3 middle_of(const TrianglePiece& t) { return (t[0] + t[1] + t[2]) / 3.0; }
/// Twice the area, along the normal.
inline dvec3 area_vector_of(const TrianglePiece& t) { return glm::cross(t[1] - t[0], t[2] - t[0]); }

/// Uniform on the triangle for uniform u and v in [0, 1).
template <typename T>
glm::vec<3, T> point_on(const TrianglePiece& t, T u, T v) {
  using Vec = glm::vec<3, T>;
  const T root = std::sqrt(u);
  return Vec(t[0]) * (1 - root) + Vec(t[1]) * (root * (1 - v)) + Vec(t[2]) * (root * v);
}

}  // namespace farfield
