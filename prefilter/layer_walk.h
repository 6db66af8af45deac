// SPDX-License-Identifier: Apache-2.0
// The cells along a ray, a part of the lattice at a time: what is larger than memory is walked through in layers.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/vec.h"
#include "prefilter/voxel_walk.h"

namespace farfield {

/// Layers of cells along z: [first, end).
struct LayerRange {
  int first = 0, end = 0;
};

/// The same points, from the end where z is smaller.
inline VoxelRay upwards(const VoxelRay& ray) {
  return ray.direction.z < 0 ? VoxelRay{ray.origin, -ray.direction, -ray.far, -ray.near} : ray;
}

/// Calls visit(cell, t_enter, t_leave) for the cells (cubes of this side, of a lattice of `dims` cells) in these layers
/// that the ray passes through, in order. Where cells begin and end does not depend on where the walk does: of a ray
/// that goes upwards the calls for one range of layers and then for the next are those for both, to the bit
/// [Amanatides and Woo 1987].
template <typename Visit>
void walk_layers(const VoxelRay& ray, int side, const ivec3& dims, const LayerRange& layers, const Visit& visit) {
  const ivec3 lower(0, 0, layers.first), upper(dims.x, dims.y, layers.end);
  const auto wall = [&](int axis, int index) {
    return (static_cast<double>(side) * index - ray.origin[axis]) / ray.direction[axis];
  };
  ivec3 cell, ahead, step;  // `ahead`: from a cell to the wall through which the ray leaves it, 0 or 1
  double near = ray.near, far = ray.far;
  for (int a = 0; a < 3; ++a) {
    const double d = ray.direction[a];
    ahead[a] = d < 0 ? 0 : 1;
    step[a] = d < 0 ? -1 : 1;
    if (d != 0) {
      near = std::max(near, wall(a, ahead[a] == 1 ? lower[a] : upper[a]));
      far = std::min(far, wall(a, ahead[a] == 1 ? upper[a] : lower[a]));
    } else if (ray.origin[a] < static_cast<double>(side) * lower[a] ||
               ray.origin[a] >= static_cast<double>(side) * upper[a]) {
      return;
    }
  }
  if (!(near < far)) return;
  dvec3 next;  // where it leaves the cell across each axis
  for (int a = 0; a < 3; ++a) {
    const double d = ray.direction[a], start = std::floor((ray.origin[a] + near * d) / side);
    cell[a] = static_cast<int>(std::clamp<double>(start, lower[a], upper[a] - 1));
    next[a] = std::numeric_limits<double>::infinity();
    if (d == 0) continue;
    // By rounding it may be a neighbour of the one that the walls say.
    while (wall(a, cell[a] + ahead[a]) <= near) cell[a] += step[a];
    while (wall(a, cell[a] + 1 - ahead[a]) > near) cell[a] -= step[a];
    next[a] = wall(a, cell[a] + ahead[a]);
  }
  for (double t = near;;) {
    const int axis = next.x < next.y ? (next.x < next.z ? 0 : 2) : (next.y < next.z ? 1 : 2);
    const double leave = std::min(next[axis], far);
    if (leave > t) {
      visit(cell, t, leave);
      t = leave;
    }
    if (!(next[axis] < far)) return;
    cell[axis] += step[axis];
    next[axis] = wall(axis, cell[axis] + ahead[axis]);
  }
}

}  // namespace farfield
