// SPDX-License-Identifier: Apache-2.0
// Sub-resolution geometry to a sparse microflake volume, by casting rays (thesis 9.2 and 9.3).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <vector>

#include "base/result.h"
#include "base/vec.h"
#include "cache/level.h"
#include "prefilter/surface.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// Where voxels lie: voxel (i, j, k) covers origin + [i, i+1] x [j, j+1] x [k, k+1] * voxel_size. The lattices of all
/// levels of an asset share the origin, so that 8 voxels of one level fill one voxel of the next.
struct VoxelLattice {
  dvec3 origin{0.0};
  double voxel_size = 0;  ///< > 0, scene units
};

/// A voxel's microflakes, in full precision.
struct Voxel {
  float density = 0;  ///< rho_g > 0, in 1 / scene unit: the attenuation along the axis of the largest eigenvalue
  SymMat3 sggx;       ///< scaled to lambda_max = 1
  vec3 diffuse{0.0f};
  vec3 specular{0.0f};
  vec3 transmission{0.0f};
  float roughness2 = 1.0f;
};

/// 8^3 voxels of the lattice, from kBrickSide * coordinate upwards.
struct VoxelBrick {
  ivec3 coordinate{0};
  std::array<uint64_t, 8> mask{};  ///< bit x + 8 y of word z: the voxel is stored
  uint64_t first_voxel = 0;        ///< of the stored ones, in the order of the bits
};

/// Sparse voxels: only what rays have hit.
struct SparseVolume {
  VoxelLattice lattice;
  std::vector<VoxelBrick> bricks;  ///< none empty; sorted by z, then y, then x
  std::vector<Voxel> voxels;
};

struct VoxelizeOptions {
  uint32_t rays_per_voxel = 200;  ///< > 0; voxels that let almost nothing through get up to 16 times as many
  uint64_t seed = 0;              ///< with the voxel's coordinate it fixes the voxel's rays
  const std::atomic<bool>* cancel = nullptr;    ///< polled for every few bricks
  std::function<void(double done)> progress{};  ///< done in [0, 1]; from any thread, one call at a time
};

/// Measures the volume of all triangles of `geometry`, with the rays of thesis algorithm 1. The lattice's origin is in
/// the space of geometry.positions. Empty geometry gives an empty volume. The result does not depend on the number of
/// threads. Errors: Cancelled; InvalidArgument (options, or geometry further than a million voxels from the origin).
Result<SparseVolume> voxelize(const Surface& geometry, const VoxelLattice& lattice, const VoxelizeOptions& options);

}  // namespace farfield
