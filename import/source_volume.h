// SPDX-License-Identifier: Apache-2.0
// A scattering medium as its file has it: a sparse grid of densities, with what else varies from voxel to voxel. What
// the reader of OpenVDB files makes and what volumes are baked from; it knows nothing of OpenVDB.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/big_vector.h"
#include "base/vec.h"

namespace farfield {

inline constexpr int kVolumeBrickSide = 8;      ///< as cache/level.h has it
inline constexpr int kVolumeBrickVoxels = 512;  ///< x fastest, then y, then z
inline constexpr uint32_t kEmptyBrick = 0xffffffffu;
inline constexpr uint64_t kMostTableBricks = uint64_t{1} << 26;  ///< the table of a level takes 4 bytes for each
inline constexpr uint64_t kMostVolumeVoxels = 0xfffffff0ull;     ///< of a level: payload indices have 32 bits
inline constexpr double kDensestVolume = 1e30;                   ///< times lengths and squares stay floats

/// sigma_t of 8^3 voxels in 1 / scene unit, finite and >= 0.
using DensityBrick = std::array<float, kVolumeBrickVoxels>;
/// Single-scattering albedos of 8^3 voxels, linear RGB: 65535 is 1.
using AlbedoBrick = std::array<std::array<uint16_t, 3>, kVolumeBrickVoxels>;
inline vec3 unpack_albedo(const std::array<uint16_t, 3>& a) { return vec3(a[0], a[1], a[2]) * (1.0f / 65535.0f); }

/// Ellipsoids of attenuation S, of SGGX [Heitz et al. 2015], of 8^3 voxels: S_xx, S_yy, S_zz, S_xy, S_xz, S_yz along
/// the grid's axes, trace 1. sigma_t(w) = density sqrt(w^T S w), so that densities are sigma_t no longer.
using ShapeBrick = std::array<std::array<float, 6>, kVolumeBrickVoxels>;
inline constexpr std::array<float, 6> kRoundShape = {1.0f / 3, 1.0f / 3, 1.0f / 3, 0, 0, 0};
using ColorBrick = std::array<vec3, kVolumeBrickVoxels>;  ///< linear RGB
using NumberBrick = std::array<float, kVolumeBrickVoxels>;
using OctantsBrick = std::array<uint16_t, kVolumeBrickVoxels>;  ///< as levels have them (cache/octants.h)

/// Densities of a sparse grid, in bricks. Voxel (i, j, k) is the cube voxel_size * [i, i + 1] x [j, j + 1] x [k, k +
/// 1].
struct DensityGrid {
  double voxel_size = 0;  ///< > 0, scene units
  ivec3 dims{0};          ///< voxels; the rest of the last bricks is empty
  ivec3 brick_dims{0};
  std::vector<uint32_t> brick_table;  ///< x fastest: index into bricks, or kEmptyBrick
  BigVector<DensityBrick> bricks;     ///< in no particular order
  BigVector<ShapeBrick> shapes;       ///< none: round everywhere, and densities are sigma_t. Else as many as bricks

  size_t table_index(const ivec3& brick) const {
    return static_cast<size_t>(brick.x) +
           static_cast<size_t>(brick_dims.x) *
               (static_cast<size_t>(brick.y) + static_cast<size_t>(brick_dims.y) * static_cast<size_t>(brick.z));
  }
  /// The coordinates that table_index() has an entry from.
  ivec3 brick_of_entry(size_t entry) const {
    const auto e = static_cast<int>(entry);
    return {e % brick_dims.x, e / brick_dims.x % brick_dims.y, e / (brick_dims.x * brick_dims.y)};
  }
  /// Index of the brick at these coordinates, in bricks; kEmptyBrick also outside of the grid.
  uint32_t brick_at(const ivec3& brick) const {
    for (int axis = 0; axis < 3; ++axis)
      if (brick[axis] < 0 || brick[axis] >= brick_dims[axis]) return kEmptyBrick;
    return brick_table[table_index(brick)];
  }
};

/// What voxels have that are flakes, pieces of surfaces, and no fog. Each vector: none, or as many as bricks.
struct SourceFlakes {
  BigVector<ColorBrick> diffuse, specular, transmission;  ///< reflectances in [0, 1]; none: 0
  BigVector<ColorBrick> emission;                         ///< radiance; none: 0
  BigVector<NumberBrick> roughness;                       ///< GGX alpha is its square; with specular
  BigVector<OctantsBrick> octants;         ///< how octants share the largest density; the voxel's is their mean
  float hot_spot = 0, highlight_lean = 0;  ///< of all, as levels have them
  vec3 open_side{0.0f};                    ///< the same, along the grid's axes
};

/// Immutable once read; any thread. Bounds are tight: the first and the last voxel along each axis that have a density
/// are in it. Bricks may be shared by entries of the table (tiles).
struct SourceVolume : DensityGrid {
  dvec3 origin{0.0};                      ///< lower corner of voxel (0, 0, 0), in the source's space
  glm::dmat3 rotation{1.0};               ///< columns: the grid's axes in the source's space; orthonormal, may mirror
  BigVector<AlbedoBrick> albedos;         ///< none: `albedo` everywhere. Else as many as bricks
  vec3 albedo{1.0f};                      ///< single scattering, linear RGB in [0, 1]
  float anisotropy = 0;                   ///< g of Henyey and Greenstein
  BigVector<NumberBrick> anisotropies;    ///< none: `anisotropy` everywhere. Else as many as bricks
  BigVector<NumberBrick> self_shadowing;  ///< A in (0, 1]; none: 1. Else as many as bricks
  std::optional<SourceFlakes> flakes;     ///< none: fog. Else albedos and anisotropies do not count
  uint64_t active_voxels = 0;             ///< with a density
  uint64_t filled_bricks = 0;             ///< entries of the table that are not kEmptyBrick
  float densest = 0;                      ///< the largest density
  std::vector<std::string> warnings;      ///< one line each: what was ignored, guessed or dropped
  uint64_t source_hash = 0;               ///< of the file's bytes and the options
};

/// What of it is in files leaves memory until it is looked at again (base/big_vector.h). Any thread.
inline void rest(const DensityGrid& grid) {
  rest(grid.bricks);
  rest(grid.shapes);
}
inline void rest(const SourceVolume& volume) {
  rest(static_cast<const DensityGrid&>(volume));
  rest(volume.albedos);
  rest(volume.anisotropies);
  rest(volume.self_shadowing);
  if (!volume.flakes) return;
  for (const auto* colors :
       {&volume.flakes->diffuse, &volume.flakes->specular, &volume.flakes->transmission, &volume.flakes->emission})
    rest(*colors);
  rest(volume.flakes->roughness);
  rest(volume.flakes->octants);
}

/// Index of a voxel within its brick.
inline size_t index_in_brick(const ivec3& voxel) {
  return static_cast<size_t>((voxel.x & 7) | (voxel.y & 7) << 3 | (voxel.z & 7) << 6);
}
/// The voxel with that index, from its brick's first.
inline ivec3 voxel_in_brick(int index) { return {index & 7, index >> 3 & 7, index >> 6}; }

}  // namespace farfield
