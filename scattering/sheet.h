// SPDX-License-Identifier: Apache-2.0
// Sheets with gaps: what a face stands for whose pieces (planks, slats, wires, cloth with holes) stop more rays the
// flatter these are (docs/decisions/0031).
//
// Towards w the pieces show, per area of the sheet that w sees, their front and their sides:
//
//   front = 1,   sides = sqrt(t^T S t / n^T S n) / |w.n|,   t = w - (w.n) n,   round = sqrt(front^2 + sides^2)
//   x     = cover ((1 - edge) round + edge (front + sides))
//
// S: their projected areas squared. Planks with square edges have edge 1, round wires 0; both are exact. Pieces that
// keep clear of each other hide x of what is behind, others less. `order` says which: (1 - order x)^(1 / order) is
// open; at order 1 nothing overlaps, near 0 all is random, at 1/2 two layers do not know of each other.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/vec.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// How the pieces lie, in [0, 1] all.
struct SheetShape {
  float edge = 0;
  float order = 0;   ///< 0: it is no sheet, and lets the same share through in all directions
  float caught = 0;  ///< share of the light that sides send on which meets other pieces, on average over directions

  bool is_sheet() const { return order > 0; }
  friend SheetShape operator*(const SheetShape& a, float f) { return {a.edge * f, a.order * f, a.caught * f}; }
  friend SheetShape operator+(const SheetShape& a, const SheetShape& b) {
    return {a.edge + b.edge, a.order + b.order, a.caught + b.caught};
  }
  friend bool operator==(const SheetShape&, const SheetShape&) = default;
};

/// What is seen along w, in units of the front's area along n; front is 1.
struct SheetAreas {
  float sides = 0;  ///< infinite along the sheet
  float round() const { return std::sqrt(1 + sides * sides); }
  float all(float edge) const { return (1 - edge) * round() + edge * (1 + sides); }
};

/// n: the sheet's unit normal, w: any direction; of any length and sign, in the space of S, as is S's scale.
inline SheetAreas sheet_areas(const SymMat3& s, const vec3& n, const vec3& w) {
  const float along = glm::dot(w, n), front2 = s.quadratic(n);
  const float sides2 = std::max(s.quadratic(w - along * n), 0.0f);
  if (!(sides2 > 0)) return {0};
  return {std::sqrt(sides2 / front2) / std::abs(along)};
}

/// The share of rays along w that pass. gap: of those along n; shape.is_sheet().
inline float sheet_gap(const SheetShape& shape, float gap, const SheetAreas& areas) {
  if (gap <= 0 || gap >= 1) return gap;
  const float closed = (1 - std::pow(gap, shape.order)) * areas.all(shape.edge);
  return closed < 1 ? std::pow(1 - closed, 1 / shape.order) : 0.0f;
}

}  // namespace farfield
