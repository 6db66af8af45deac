// SPDX-License-Identifier: Apache-2.0
#include "prefilter/voxel_marks.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "base/check.h"
#include "base/parallel_job.h"
#include "prefilter/triangle_pieces.h"

namespace farfield {
namespace {

/// Voxels by brick, while they are being marked. One thread at a time.
class BrickMarks {
 public:
  /// Marks all voxels of a box, upper corner included. Most are within one brick, and in that of the box before.
  void mark(const ivec3& lower, const ivec3& upper) {
    for_each_cell(lower >> 3, upper >> 3, [&](const ivec3& brick) {
      const ivec3 corner = brick * kBrickSide;
      mark_in_brick(mask_of(brick), glm::max(lower - corner, 0), glm::min(upper - corner, kBrickSide - 1));
    });
  }

  const std::unordered_map<uint64_t, VoxelMask>& masks() const { return masks_; }

 private:
  VoxelMask& mask_of(const ivec3& brick) {
    const uint64_t key = cell_key(brick);
    if (!mask_ || key != key_) key_ = key, mask_ = &masks_[key];
    return *mask_;
  }

  static void mark_in_brick(VoxelMask& mask, const ivec3& lower, const ivec3& upper) {
    const uint64_t row = (uint64_t{2} << upper.x) - (uint64_t{1} << lower.x);
    uint64_t slice = 0;
    for (int y = lower.y; y <= upper.y; ++y) slice |= row << (8 * y);
    for (int z = lower.z; z <= upper.z; ++z) mask[static_cast<size_t>(z)] |= slice;
  }

  std::unordered_map<uint64_t, VoxelMask> masks_;  ///< whose elements stay where they are
  uint64_t key_ = 0;
  VoxelMask* mask_ = nullptr;  ///< of key_
};

/// Marks the voxels in the box of a piece of a triangle that is about as small as a voxel; in voxel units.
void mark_piece(const TrianglePiece& t, BrickMarks& marks) {
  const CellRange voxels = cells_of(t);
  marks.mark(voxels.first, voxels.last);
}

/// What was marked, in the order of a VoxelSet.
VoxelSet united(const std::vector<BrickMarks>& chunks) {
  std::vector<std::pair<uint64_t, const VoxelMask*>> parts;
  for (const BrickMarks& marks : chunks) {
    for (const auto& [key, mask] : marks.masks()) parts.emplace_back(key, &mask);
  }
  std::sort(parts.begin(), parts.end());
  VoxelSet set;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (i == 0 || parts[i].first != parts[i - 1].first) {
      set.coordinates.push_back(cell_of_key(parts[i].first));
      set.masks.push_back({});
    }
    for (size_t z = 0; z < set.masks.back().size(); ++z) set.masks.back()[z] |= (*parts[i].second)[z];
  }
  return set;
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

VoxelSet mark_voxels(const Surface& geometry, const VoxelLattice& lattice, const Job& job) {
  constexpr size_t kGrain = 4096;
  std::vector<BrickMarks> chunks((geometry.triangles.size() + kGrain - 1) / kGrain);
  const bool is_done = parallel_for(job.quiet(), "", geometry.triangles.size(), kGrain, [&](size_t begin, size_t end) {
    BrickMarks& marks = chunks[begin / kGrain];
    for (size_t i = begin; i < end; ++i) {
      for_each_piece(in_cells(corners_of(geometry, i), lattice.origin, lattice.voxel_size), 1,
                     [&](const TrianglePiece& piece) { mark_piece(piece, marks); });
    }
  });
  return is_done ? united(chunks) : VoxelSet{};
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
