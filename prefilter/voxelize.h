// SPDX-License-Identifier: Apache-2.0
// Sub-resolution geometry to a sparse microflake volume, by casting rays (thesis 9.2 and 9.3).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "base/vec.h"
#include "prefilter/ray_scene.h"
#include "prefilter/surface.h"
#include "prefilter/voxel_marks.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// A voxel's microflakes, in full precision.
struct Voxel {
  float density = 0;  ///< rho_g > 0, in 1 / scene unit: the attenuation along the axis of the largest eigenvalue
  PackedOctants octants = kFullOctants;  ///< where in the voxel that is so. Not measured by voxelize()
  SymMat3 sggx;                          ///< scaled to lambda_max = 1
  vec3 diffuse{0.0f};
  vec3 specular{0.0f};
  vec3 transmission{0.0f};
  float roughness2 = 1.0f;
  float self_shadowing = 1.0f;  ///< A in (0, 1]; 1: none. Not measured by voxelize()
  vec3 emission{0.0f};          ///< linear radiance of the flakes, both sides
};

/// 8^3 voxels of the lattice, from kBrickSide * coordinate upwards.
struct VoxelBrick {
  ivec3 coordinate{0};
  VoxelMask mask{};          ///< the stored voxels
  uint64_t first_voxel = 0;  ///< of the stored ones, in the order of the bits
};

/// Sparse voxels: only what rays have hit.
struct SparseVolume {
  VoxelLattice lattice;
  std::vector<VoxelBrick> bricks;  ///< none empty; sorted by z, then y, then x
  std::vector<Voxel> voxels;
  // Of all voxels; not measured by voxelize().
  float hot_spot = 0;        ///< scattering/hot_spot.h
  float highlight_lean = 0;  ///< scattering/highlight_lean.h
  vec3 open_side{0.0f};      ///< scattering/open_side.h
};

/// Some of the bricks that may hold voxels, by their number in the order of SparseVolume::bricks. Ranges that follow
/// each other give volumes that follow each other: together just what the whole gives.
struct BrickRange {
  uint64_t first = 0;
  uint64_t count = ~uint64_t{0};  ///< as far as there are bricks
};

struct VoxelizeOptions {
  uint32_t rays_per_voxel = 200;  ///< > 0; see voxelize()
  uint64_t seed = 0;              ///< with the voxel's coordinate it fixes the voxel's rays
  BrickRange bricks{};            ///< to measure; candidate_bricks() says how many there are
  Job job{};                      ///< reports from the calling thread alone; polled for every few bricks
};

/// Measures the volume of all triangles of `geometry`, each of which stops as many rays as its opacity says, with the
/// rays of thesis algorithm 1, but with their middles in the voxel. Each voxel that the geometry touches or that is
/// next to such a one gets rays_per_voxel; up to 16 times as many where almost nothing gets through, and where there
/// are few voxels. Each voxel is measured alone: what rays see of all together comes later (measure_volume.h). The
/// lattice's origin is in the space of geometry.positions. Empty geometry gives an empty
/// volume. The result does not depend on the number of threads. Errors: Cancelled; InvalidArgument (options, or
/// geometry further than about a million voxels from the origin); Io (out of memory in Embree).
Result<SparseVolume> voxelize(const Surface& geometry, const VoxelLattice& lattice, const VoxelizeOptions& options);

/// The same for a surface whose scene is there already.
Result<SparseVolume> voxelize(const OpacityScene& geometry, const VoxelLattice& lattice,
                              const VoxelizeOptions& options);

/// The number of bricks that voxelize() looks at, some of which turn out empty. Fast: no ray is cast.
uint64_t candidate_bricks(const Surface& geometry, const VoxelLattice& lattice);

/// What a volume would hold.
struct VolumeSize {
  uint64_t voxels = 0;
  uint64_t bricks = 0;
};

/// About what voxelize() and thin_out() would give, from every 32nd brick: within a few percent for large volumes, and
/// in a thirtieth of the time. Long lines leave fewer voxels: three quarters or more. Small volumes are not worth an
/// estimate: 0. Arguments and errors as for voxelize().
Result<VolumeSize> estimate_volume(const Surface& geometry, const VoxelLattice& lattice,
                                   const VoxelizeOptions& options);

}  // namespace farfield
