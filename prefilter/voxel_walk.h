// SPDX-License-Identifier: Apache-2.0
// The stored voxels along a ray, in order. Everything is in voxels: points in voxels of the lattice from its origin,
// lengths in voxel sides.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "base/vec.h"
#include "prefilter/voxelize.h"

namespace farfield {

/// A part of a ray: points origin + t direction, t in [near, far]. The direction is unit.
struct VoxelRay {
  dvec3 origin{0.0};
  dvec3 direction{0.0, 0.0, 1.0};
  double near = 0, far = 0;
};

/// A box, lower corner and size, in voxels.
struct VoxelBox {
  dvec3 lower{0.0}, upper{0.0};
};

/// Calls visit(cell, t_enter, t_leave) for the cells (cubes of this side) that the ray passes through, in order, from
/// the one where it starts on, as long as they are in [lower, upper) and visit returns true; false if it did not
/// [Amanatides and Woo 1987].
template <typename Visit>
bool walk_cells(const VoxelRay& ray, int side, const ivec3& lower, const ivec3& upper, Visit&& visit) {
  ivec3 cell, step;
  dvec3 next, stride;  // along the ray: to the next wall across each axis, from wall to wall
  for (int a = 0; a < 3; ++a) {
    const double d = ray.direction[a];
    const double start = std::floor((ray.origin[a] + ray.near * d) / side);
    cell[a] = static_cast<int>(std::clamp<double>(start, lower[a], upper[a] - 1));
    step[a] = d > 0 ? 1 : -1;
    const double wall = static_cast<double>(side) * (cell[a] + (d > 0 ? 1 : 0));
    next[a] = d != 0 ? (wall - ray.origin[a]) / d : std::numeric_limits<double>::infinity();
    stride[a] = d != 0 ? side / std::abs(d) : 0;
  }
  double t = ray.near;
  while (true) {
    const int axis = next.x < next.y ? (next.x < next.z ? 0 : 2) : (next.y < next.z ? 1 : 2);
    const double leave = std::min(next[axis], ray.far);
    if (leave > t) {
      if (!visit(cell, t, leave)) return false;
      t = leave;
    }
    if (!(next[axis] < ray.far)) return true;
    cell[axis] += step[axis];
    if (cell[axis] < lower[axis] || cell[axis] >= upper[axis]) return true;
    next[axis] += stride[axis];
  }
}

/// Where the stored voxels of a volume are. Immutable; any thread.
class VoxelGrid {
 public:
  explicit VoxelGrid(const SparseVolume& volume);

  /// Around the stored voxels; empty volume: of size 0.
  const VoxelBox& box() const { return box_; }

  /// The number of a stored voxel in the volume.
  std::optional<uint32_t> find(const ivec3& voxel) const {
    const ivec3 at = voxel >> 3;
    for (int a = 0; a < 3; ++a) {
      if (at[a] < lower_[a] || at[a] >= upper_[a]) return {};
    }
    const uint32_t brick = table_[cell_of(at)];
    return brick == kNoBrick ? std::nullopt : bricks_[brick].find(voxel - at * kBrickSide);
  }

  /// Calls visit(number of the voxel in the volume, t_enter, t_leave) along the ray, in order, while it returns true.
  /// Never for rays that are not finite.
  template <typename Visit>
  void walk(const VoxelRay& ray, Visit&& visit) const {
    const VoxelRay inside = clipped(ray);
    if (!(inside.near < inside.far)) return;
    walk_cells(inside, kBrickSide, lower_, upper_, [&](const ivec3& at, double enter, double leave) {
      const uint32_t number = table_[cell_of(at)];
      return number == kNoBrick || walk_brick({inside.origin, inside.direction, enter, leave}, at, number, visit);
    });
  }

 private:
  struct Brick {
    VoxelMask mask;
    std::array<uint32_t, 8> first_of_word;  ///< number of the first voxel of each word

    /// `c`: from the brick's corner, in [0, kBrickSide).
    std::optional<uint32_t> find(const ivec3& c) const {
      const auto word = static_cast<size_t>(c.z);
      const uint64_t bit = uint64_t{1} << (c.x + kBrickSide * c.y);
      if (!(mask[word] & bit)) return {};
      return first_of_word[word] + static_cast<uint32_t>(__builtin_popcountll(mask[word] & (bit - 1)));
    }
  };

  size_t cell_of(const ivec3& brick) const {
    const ivec3 c = brick - lower_, n = upper_ - lower_;
    return static_cast<size_t>(c.x) +
           static_cast<size_t>(n.x) * (static_cast<size_t>(c.y) + static_cast<size_t>(n.y) * static_cast<size_t>(c.z));
  }

  template <typename Visit>
  bool walk_brick(const VoxelRay& ray, const ivec3& at, uint32_t number, Visit&& visit) const {
    const ivec3 corner = at * kBrickSide;
    const Brick& brick = bricks_[number];
    return walk_cells(ray, 1, corner, corner + kBrickSide, [&](const ivec3& cell, double enter, double leave) {
      const auto number_of_voxel = brick.find(cell - corner);
      return !number_of_voxel || static_cast<bool>(visit(*number_of_voxel, enter, leave));
    });
  }

  VoxelRay clipped(VoxelRay ray) const;

  ivec3 lower_{0}, upper_{0};    ///< bricks
  std::vector<uint32_t> table_;  ///< for each cell of [lower_, upper_), x fastest: number of its brick, or kNoBrick
  std::vector<Brick> bricks_;
  VoxelBox box_;
};

}  // namespace farfield
