// SPDX-License-Identifier: Apache-2.0
// Cells of a grid: voxels, bricks of voxels, places.
#pragma once

#include <cstdint>

#include "base/vec.h"

namespace farfield {

/// Cells must be less than this far from the grid's origin, in cells.
inline constexpr int kCellLimit = 1 << 20;

/// A cell as one number; their order is by z, then y, then x.
inline uint64_t cell_key(const ivec3& cell) {
  const auto biased = [](int v) { return static_cast<uint64_t>(v + kCellLimit) & 0x1fffff; };
  return biased(cell.z) << 42 | biased(cell.y) << 21 | biased(cell.x);
}
inline ivec3 cell_of_key(uint64_t key) {
  const auto part = [&](int shift) { return static_cast<int>(key >> shift & 0x1fffff) - kCellLimit; };
  return {part(0), part(21), part(42)};
}

/// Calls visit(cell) for the cells from `lower` to `upper`, both included, x fastest.
template <typename Visit>
void for_each_cell(const ivec3& lower, const ivec3& upper, Visit&& visit) {
  for (int z = lower.z; z <= upper.z; ++z) {
    for (int y = lower.y; y <= upper.y; ++y) {
      for (int x = lower.x; x <= upper.x; ++x) visit(ivec3(x, y, z));
    }
  }
}

/// Calls visit(cell) for the (2 reach + 1)^3 cells around one.
template <typename Visit>
void for_each_cell_around(const ivec3& cell, int reach, Visit&& visit) {
  for_each_cell(cell - reach, cell + reach, visit);
}

}  // namespace farfield
