// SPDX-License-Identifier: Apache-2.0
// Coarser levels of a scattering medium (thesis 14.1, with the errata of docs/theory.md): a block of 2^k voxels of the
// source along each axis becomes one voxel, always from the source and never from the level before, each block alone.
//
//   Linear  mean density, albedos weighted by density
//   Transp  the density that lets through what the block lets through along the three axes
//   Iso     the same, and what the block's light loses or spreads by being scattered among its own voxels
//   Aniso   the same along each axis: an ellipsoid of attenuation
//   Matched Iso, and then densities that let through what the source lets through along whole lines: blocks are no
//           longer independent (match_fog.h). Not in the thesis; the default
//
// What Iso keeps depends on what the medium can show. Where scattering is isotropic, single and multiple scattering
// look alike, and what is left of the thesis's alpha_ss, A and alpha_ms is the albedo of a collision that makes the
// block as bright as it was (14.1.16): an albedo where the source's varies, else the scalar A that gives it
// (scattering/albedo.h), and nothing where it is white. Where scattering is not isotropic, A is the share of light that
// the block lets go after one event (14.1.13).
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "base/job.h"
#include "base/result.h"
#include "base/vec.h"
#include "cache/level.h"
#include "import/source_volume.h"
#include "prefilter/block_light.h"
#include "scattering/sym_mat3.h"

namespace farfield {

enum class Downsampling : uint8_t { Linear, Transp, Iso, Aniso, Matched };
/// "linear", "transp", "iso", "aniso", "matched".
const char* name_of(Downsampling method);
/// Errors: InvalidArgument, with the names that there are.
Result<Downsampling> parse_downsampling(const std::string& name);

// Of a source whose voxels have ellipsoids of attenuation (SGGX), coarser voxels have the mean ellipsoid, and densities
// that let through what they should through it; Aniso stretches it by the axes. Of flakes, reflectances are means, and
// light is not followed.

/// Goes up when downsample() comes to give other results.
inline constexpr uint32_t kFogVersion = 3;

/// What a voxel of flakes has besides what fog has: means over its block.
struct FlakeLook {
  vec3 diffuse{0.0f}, specular{0.0f}, transmission{0.0f}, emission{0.0f};  ///< as SourceFlakes has them
  float roughness = 0;
  PackedOctants octants = kFullOctants;  ///< of level 0
};

/// A voxel of a level, in full precision.
struct FogVoxel {
  float density = 0;                    ///< sigma_t in 1 / scene unit, along the axis in which it is largest; 0: empty
  vec3 albedo{0.0f};                    ///< single scattering, linear RGB
  float self_shadowing = 1;             ///< A in (0, 1]
  float anisotropy = 0;                 ///< mean cosine of all that the voxel scatters; of Matched
  SymMat3 shape = SymMat3::identity();  ///< of the attenuation; lambda_max = 1
  FlakeLook flakes;                     ///< of flakes alone
};

/// Makes the voxels of one level, k >= 1, from a source that outlives it. Immutable; any thread.
class FogDownsampler {
 public:
  FogDownsampler(const SourceVolume& source, uint32_t level, Downsampling method);

  /// Voxels of the level along each axis.
  ivec3 dims() const { return dims_; }
  /// The voxel; each coordinate from 0 to below dims(). Depends on the arguments and the source alone.
  FogVoxel voxel(const ivec3& coordinate) const;
  /// Of Matched: the same for a density that is known.
  FogVoxel voxel(const ivec3& coordinate, float density) const;
  /// Density and shape alone, of Transp: the mean along the three axes of what lets through what the block does, and
  /// the block's mean shape.
  struct Attenuation {
    float density = 0;
    SymMat3 shape = SymMat3::identity();
  };
  Attenuation attenuation(const ivec3& coordinate) const;

 private:
  BlockRays block_rays(const ivec3& coordinate) const;
  /// What makes the collisions of the cube as bright as those of the block (14.1.16).
  void set_albedo(const dvec3& albedo, const BlockLight& of_block, const BlockLight& of_cube, FogVoxel& voxel) const;

  const SourceVolume& source_;
  uint32_t level_;
  Downsampling method_;
  ivec3 dims_;
};

/// The densities of level k >= 1 as Matched has them. Errors: Cancelled.
Result<DensityGrid> matched_densities(const SourceVolume& source, uint32_t level, const Job& job = {});

}  // namespace farfield
