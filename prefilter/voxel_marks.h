// SPDX-License-Identifier: Apache-2.0
// Sets of voxels near geometry: the candidates of a voxelisation.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/hash.h"
#include "base/job.h"
#include "base/vec.h"
#include "cache/level.h"
#include "prefilter/grid_cells.h"
#include "prefilter/surface.h"

namespace farfield {

/// Where voxels lie: voxel (i, j, k) covers origin + [i, i+1] x [j, j+1] x [k, k+1] * voxel_size. Each level of an
/// asset has an origin of its own (place_lattice.h): lattices are not nested.
struct VoxelLattice {
  dvec3 origin{0.0};
  double voxel_size = 0;  ///< > 0, scene units
};

/// 8^3 voxels: bit x + 8 y of word z.
using VoxelMask = std::array<uint64_t, 8>;

/// Whether the set has the brick's voxel i, as bricks number them (cache/level.h).
inline bool is_set(const VoxelMask& mask, int i) { return mask[static_cast<size_t>(i >> 6)] >> (i & 63) & 1; }

/// The coordinate of voxel i of a brick.
inline ivec3 voxel_of_brick(const ivec3& brick, int i) { return brick * kBrickSide + ivec3(i & 7, i >> 3 & 7, i >> 6); }

inline size_t voxel_count(const VoxelMask& mask) {
  size_t count = 0;
  for (const uint64_t word : mask) count += static_cast<size_t>(__builtin_popcountll(word));
  return count;
}

/// The seed of what is random about one voxel or brick.
inline uint64_t seed_of(const ivec3& coordinate, uint64_t seed) {
  const auto bits = [](int v) { return static_cast<uint64_t>(static_cast<uint32_t>(v)); };
  return mix64(mix64(seed, bits(coordinate.x) << 32 | bits(coordinate.y)), bits(coordinate.z));
}

/// A set of voxels, by the bricks (from kBrickSide * coordinate upwards) that hold some.
struct VoxelSet {
  std::vector<ivec3> coordinates;  ///< of bricks; sorted by z, then y, then x
  std::vector<VoxelMask> masks;    ///< one per brick, not 0

  uint64_t size() const;
};

/// All voxels that triangles pass through, and some that they pass by within a voxel. All geometry must lie within
/// kCellLimit - 64 voxels of the origin. Deterministic for any thread count. None once the job is cancelled.
VoxelSet mark_voxels(const Surface& geometry, const VoxelLattice& lattice, const Job& job = {});

/// The largest reach of widen().
inline constexpr int kMaxReach = 3;

/// All voxels whose centre is within `reach` voxels (at most kMaxReach) of the nearest point of one of the set.
VoxelSet widen(const VoxelSet& set, double reach);

}  // namespace farfield
