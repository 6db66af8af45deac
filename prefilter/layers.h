// SPDX-License-Identifier: Apache-2.0
// Layers: geometry that is thin along one direction and reaches far along two others.
#pragma once

#include <optional>

#include "base/vec.h"
#include "prefilter/triangle_pieces.h"

namespace farfield {

/// Integrals over faces: area, first and second moments.
struct Moments {
  double area = 0;
  dvec3 first{0.0};
  glm::dmat3 second{0.0};

  void add(const TrianglePiece& t) {
    const double piece_area = 0.5 * glm::length(area_vector_of(t));
    const dvec3 middle = middle_of(t);
    area += piece_area;
    first += piece_area * middle;
    second += piece_area * 0.75 * glm::outerProduct(middle, middle);
    for (const dvec3& p : t) second += piece_area / 12 * glm::outerProduct(p, p);
  }
  void add(const Moments& other, double factor = 1) {
    area += factor * other.area;
    first += factor * other.first;
    second += factor * other.second;
  }
  dvec3 middle() const { return first / area; }
  glm::dmat3 covariance() const { return second / area - glm::outerProduct(middle(), middle()); }
};

/// Where the middle of a layer is.
struct Layer {
  dvec3 middle, normal;  ///< unit

  /// Above its plane, along the normal.
  double height(const dvec3& point) const { return glm::dot(point - middle, normal); }
};

/// The unit eigenvector of an eigenvalue that no other is near.
std::optional<dvec3> eigenvector(const glm::dmat3& m, double eigenvalue);
/// Largest first.
dvec3 eigenvalues_of(const glm::dmat3& m);

}  // namespace farfield
