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

/// Cuts a triangle into pieces none of whose edges is longer than `longest` (> 0), and visits them.
///
/// Needles are cut across, into pieces about as long as they are wide, others are halved across their longest edge.
/// (One half of a needle is a needle as long as before: halving alone makes L^1.6 pieces of one that is L times too
/// long.)
template <typename Visit>
void for_each_piece(const TrianglePiece& t, double longest, Visit&& visit);

/// The pieces of a needle between `apex` and the edge from a to b, cut into this many slices.
template <typename Visit>
void for_each_piece_of_needle(const dvec3& apex, const dvec3& a, const dvec3& b, int slices, double longest,
                              Visit&& visit) {
  dvec3 a_before = apex, b_before = apex;
  for (int i = 1; i <= slices; ++i) {
    const double share = static_cast<double>(i) / slices;
    const dvec3 a_here = i == slices ? a : apex + share * (a - apex),
                b_here = i == slices ? b : apex + share * (b - apex);
    for_each_piece({a_before, a_here, b_here}, longest, visit);
    if (i > 1) for_each_piece({a_before, b_here, b_before}, longest, visit);
    a_before = a_here, b_before = b_here;
  }
}

template <typename Visit>
void for_each_piece(const TrianglePiece& t, double longest, Visit&& visit) {
  constexpr double kNeedle = 3;    // length against width
  constexpr double kSlice = 0.75;  // length of a slice: its diagonal, too, should be short enough
  constexpr double kMostSlices = 1 << 20;
  std::array<double, 3> length2;
  for (size_t c = 0; c < 3; ++c) {
    const dvec3 edge = t[(c + 1) % 3] - t[c];
    length2[c] = glm::dot(edge, edge);
  }
  const size_t cut = static_cast<size_t>(std::max_element(length2.begin(), length2.end()) - length2.begin());
  if (!(length2[cut] > longest * longest)) return visit(t);

  const size_t base = static_cast<size_t>(std::min_element(length2.begin(), length2.end()) - length2.begin());
  const double length = std::sqrt(length2[cut]), width = std::max(longest, std::sqrt(length2[base]));
  if (length > kNeedle * width) {
    const int slices = static_cast<int>(std::min(std::ceil(length / (kSlice * width)), kMostSlices));
    return for_each_piece_of_needle(t[(base + 2) % 3], t[base], t[(base + 1) % 3], slices, longest, visit);
  }
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

/// The cells that the box of a triangle reaches, which is in cells: the first and the last.
struct CellRange {
  ivec3 first, last;
};
inline CellRange cells_of(const TrianglePiece& t) {
  return {ivec3(glm::floor(glm::min(t[0], glm::min(t[1], t[2])))),
          ivec3(glm::floor(glm::max(t[0], glm::max(t[1], t[2]))))};
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
