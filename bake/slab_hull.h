// SPDX-License-Identifier: Apache-2.0
// A convex hull of bounded size that surely contains a set of points: bounds of a transformed asset, tighter than those
// of its transformed box.
#pragma once

#include <array>
#include <vector>

#include "base/vec.h"

namespace farfield {

/// Intersection of slabs along 25 fixed axes (through the faces, edges and corners of a cube, and between them).
/// A plain value; one thread at a time.
class SlabHull {
 public:
  static constexpr size_t kAxisCount = 25;

  SlabHull();
  void add(const vec3& point);
  void add(const Box3& box);  ///< its eight corners; an empty box adds nothing

  /// Corners of the intersection: at most about a hundred points, whose convex hull contains all added points with a
  /// margin of some hundred-thousandths of the extent. Empty if nothing was added.
  std::vector<vec3> corners() const;

 private:
  std::array<dvec3, kAxisCount> axes_;
  std::array<double, kAxisCount> lower_, upper_;  ///< of dot(axis, point)
};

}  // namespace farfield
