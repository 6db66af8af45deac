// SPDX-License-Identifier: Apache-2.0
// Triangles in pieces that are small against the cells of a grid.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

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

inline TrianglePiece corners_of(const Surface& surface, size_t face) {
  const uvec3& t = surface.triangles[face];
  return {dvec3(surface.positions[t.x]), dvec3(surface.positions[t.y]), dvec3(surface.positions[t.z])};
}

inline dvec3 middle_of(const TrianglePiece& t) { return (t[0] + t[1] + t[2]) / 3.0; }
/// Twice the area, along the normal.
inline dvec3 area_vector_of(const TrianglePiece& t) { return glm::cross(t[1] - t[0], t[2] - t[0]); }

/// A cell of a grid as one number. Coordinates must be within 2^20 of 0.
inline uint64_t cell_key(const ivec3& cell) {
  constexpr int kLimit = 1 << 20;
  const auto biased = [](int v) { return static_cast<uint64_t>(v + kLimit) & 0x1fffff; };
  return biased(cell.z) << 42 | biased(cell.y) << 21 | biased(cell.x);
}

/// Calls visit(cell) for the (2 reach + 1)^3 cells around one.
template <typename Visit>
void for_each_cell_around(const ivec3& cell, int reach, Visit&& visit) {
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) visit(cell + ivec3(x, y, z));
    }
  }
}

}  // namespace farfield
