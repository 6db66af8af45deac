// SPDX-License-Identifier: Apache-2.0
// The sphere of directions as a latitude-longitude grid, and drawing from it.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "base/random.h"
#include "base/vec.h"

namespace farfield {

/// width x height cells, rows from +y down, columns from behind (+z) over -x to -z in the middle and on over +x:
///
///     column 0      width/4       width/2       3 width/4
///         +z          -x            -z             +x
struct LatLongGrid {
  int width = 1;
  int height = 1;

  /// Direction of fractional cell coordinates: x in [0, width], y in [0, height].
  vec3 direction(float x, float y) const;
  /// Index (row by row) of the cell that holds a unit direction.
  size_t cell(const vec3& direction) const;
  /// Of the cells of a row, steradian.
  double solid_angle(int row) const;
  size_t cell_count() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

/// Draws directions: cells in proportion to weight times solid angle, uniformly over solid angle within a cell.
/// Immutable.
class LatLongDistribution {
 public:
  /// weights: one per cell, >= 0, finite.
  LatLongDistribution(const LatLongGrid& grid, std::span<const float> weights);

  /// Integral of the weights over the sphere. 0: sample() and pdf() must not be used.
  double integral() const { return integral_; }
  vec3 sample(Rng& rng) const;
  float pdf(const vec3& direction) const;

 private:
  LatLongGrid grid_;
  double integral_ = 0;
  std::vector<float> cell_pdf_;    // per steradian
  std::vector<float> row_cdf_;     // height + 1 values, 0 to 1
  std::vector<float> column_cdf_;  // per row width + 1 values, 0 to 1
};

}  // namespace farfield
