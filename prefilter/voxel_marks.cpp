// SPDX-License-Identifier: Apache-2.0
#include "prefilter/voxel_marks.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/check.h"
#include "base/parallel.h"
#include "prefilter/triangle_pieces.h"

namespace farfield {
namespace {

/// A voxel of a brick: the brick's key and the bit.
struct MarkedVoxel {
  uint64_t brick;
  uint32_t bit;
  auto operator<=>(const MarkedVoxel&) const = default;
};

void sort_unique(std::vector<MarkedVoxel>& marks) {
  std::sort(marks.begin(), marks.end());
  marks.erase(std::unique(marks.begin(), marks.end()), marks.end());
}

/// Marks the voxels in the box of a piece of a triangle that is about as small as a voxel; in voxel units.
void mark_piece(const TrianglePiece& t, std::vector<MarkedVoxel>& marks) {
  const auto& [a, b, c] = t;
  const ivec3 lower(glm::floor(glm::min(a, glm::min(b, c)))), upper(glm::floor(glm::max(a, glm::max(b, c))));
  for (int z = lower.z; z <= upper.z; ++z) {
    for (int y = lower.y; y <= upper.y; ++y) {
      for (int x = lower.x; x <= upper.x; ++x) {
        marks.push_back(
            {cell_key({x >> 3, y >> 3, z >> 3}), static_cast<uint32_t>((x & 7) + 8 * (y & 7) + 64 * (z & 7))});
      }
    }
  }
}

/// Half-width along x of the voxels whose centres are within reach of a voxel at offset (dy, dz), or -1.
int reach_along_x(int dy, int dz, double reach) {
  const auto gap = [](int d) { return std::max(std::abs(d) - 0.5, 0.0); };
  for (int dx = kMaxReach; dx >= 0; --dx) {
    if (gap(dx) * gap(dx) + gap(dy) * gap(dy) + gap(dz) * gap(dz) <= reach * reach) return dx;
  }
  return -1;
}

/// The voxels within reach of those of a set, for one brick. `neighbours`: the masks of the 3^3 bricks around it, x
/// fastest, null where empty.
VoxelMask widen_brick(const std::array<const VoxelMask*, 27>& neighbours, double reach) {
  // Rows of 24 bits along x through the 3^3 bricks, of which the middle 8 are the brick's own.
  constexpr int kSide = 3 * kBrickSide;
  std::array<std::array<std::array<uint32_t, kMaxReach + 1>, kSide>, kSide> rows{};  // [z][y][half-width]
  for (int z = kBrickSide - kMaxReach; z < 2 * kBrickSide + kMaxReach; ++z) {
    for (int y = kBrickSide - kMaxReach; y < 2 * kBrickSide + kMaxReach; ++y) {
      uint32_t row = 0;
      for (int bx = 0; bx < 3; ++bx) {
        const VoxelMask* mask = neighbours[static_cast<size_t>(bx + 3 * (y >> 3) + 9 * (z >> 3))];
        if (mask) row |= static_cast<uint32_t>((*mask)[static_cast<size_t>(z & 7)] >> (8 * (y & 7)) & 0xff) << (8 * bx);
      }
      auto& widened = rows[static_cast<size_t>(z)][static_cast<size_t>(y)];
      widened[0] = row;
      for (size_t w = 1; w <= kMaxReach; ++w) widened[w] = widened[w - 1] | row << w | row >> w;
    }
  }
  VoxelMask result{};
  for (int dz = -kMaxReach; dz <= kMaxReach; ++dz) {
    for (int dy = -kMaxReach; dy <= kMaxReach; ++dy) {
      const int half_width = reach_along_x(dy, dz, reach);
      if (half_width < 0) continue;
      for (int z = 0; z < kBrickSide; ++z) {
        for (int y = 0; y < kBrickSide; ++y) {
          const uint32_t row = rows[static_cast<size_t>(kBrickSide + z + dz)][static_cast<size_t>(kBrickSide + y + dy)]
                                   [static_cast<size_t>(half_width)];
          result[static_cast<size_t>(z)] |= static_cast<uint64_t>(row >> kBrickSide & 0xff) << (8 * y);
        }
      }
    }
  }
  return result;
}

}  // namespace

uint64_t VoxelSet::size() const {
  uint64_t count = 0;
  for (const VoxelMask& mask : masks) count += voxel_count(mask);
  return count;
}

VoxelSet mark_voxels(const Surface& geometry, const VoxelLattice& lattice) {
  constexpr size_t kGrain = 4096;
  const size_t chunks = (geometry.triangles.size() + kGrain - 1) / kGrain;
  std::vector<std::vector<MarkedVoxel>> per_chunk(chunks);
  parallel_for(geometry.triangles.size(), kGrain, [&](size_t begin, size_t end) {
    std::vector<MarkedVoxel>& marks = per_chunk[begin / kGrain];
    size_t limit = 1 << 20;
    for (size_t i = begin; i < end; ++i) {
      for_each_piece(in_cells(corners_of(geometry, i), lattice.origin, lattice.voxel_size), 1,
                     [&](const TrianglePiece& piece) { mark_piece(piece, marks); });
      if (marks.size() > limit) {
        sort_unique(marks);
        limit = std::max<size_t>(limit, 2 * marks.size());
      }
    }
    sort_unique(marks);
  });

  std::vector<MarkedVoxel> all;
  for (std::vector<MarkedVoxel>& marks : per_chunk) {
    all.insert(all.end(), marks.begin(), marks.end());
    marks = {};
  }
  sort_unique(all);
  VoxelSet set;
  for (size_t i = 0; i < all.size(); ++i) {
    if (i == 0 || all[i].brick != all[i - 1].brick) {
      set.coordinates.push_back(cell_of_key(all[i].brick));
      set.masks.push_back({});
    }
    set.masks.back()[all[i].bit >> 6] |= uint64_t{1} << (all[i].bit & 63);
  }
  return set;
}

VoxelSet widen(const VoxelSet& set, double reach) {
  FARFIELD_CHECK(reach <= kMaxReach);
  std::unordered_map<uint64_t, const VoxelMask*> mask_of;
  std::vector<uint64_t> keys;
  for (size_t i = 0; i < set.coordinates.size(); ++i) {
    mask_of[cell_key(set.coordinates[i])] = &set.masks[i];
    for (int n = 0; n < 27; ++n) {
      keys.push_back(cell_key(set.coordinates[i] + ivec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
    }
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());

  std::vector<VoxelMask> masks(keys.size());
  parallel_for(keys.size(), 64, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      std::array<const VoxelMask*, 27> neighbours{};
      for (int n = 0; n < 27; ++n) {
        const auto found = mask_of.find(cell_key(cell_of_key(keys[i]) + ivec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
        if (found != mask_of.end()) neighbours[static_cast<size_t>(n)] = found->second;
      }
      masks[i] = widen_brick(neighbours, reach);
    }
  });
  VoxelSet result;
  for (size_t i = 0; i < keys.size(); ++i) {
    if (masks[i] == VoxelMask{}) continue;
    result.coordinates.push_back(cell_of_key(keys[i]));
    result.masks.push_back(masks[i]);
  }
  return result;
}

}  // namespace farfield
