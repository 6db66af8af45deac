// SPDX-License-Identifier: Apache-2.0
// The phase function of prefiltered volumes: SGGX microflakes, diffuse, specular and transmitting, with isotropic
// self-shadowing (Heitz et al. 2015; thesis 12.2, 13.3).
#pragma once

#include "base/random.h"
#include "base/vec.h"
#include "scattering/scatter_sample.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// Scattering parameters of a voxel in the space of the directions (world).
struct FlakeParams {
  SymMat3 sggx;  ///< any scale; specular flakes: specular_sggx(sggx, roughness2)
  vec3 diffuse{0.0f};
  vec3 specular{0.0f};  ///< F0
  vec3 transmission{0.0f};
  float roughness2 = 1.0f;
  float self_shadowing = 1.0f;  ///< A in (0, 1]; 1: none
};

/// A voxel's scattering seen from wo, given that a collision happened. Directions are unit, away from the point.
/// Immutable; any thread. At most 160 bytes, no allocation.
class FlakePhase {
 public:
  FlakePhase(const FlakeParams& params, const vec3& wo);
  /// albedo * phase function; an unbiased one-sample estimate for diffuse flakes (rng).
  vec3 eval(const vec3& wi, Rng& rng) const;
  /// The density that multiple importance sampling uses for sample(), per steradian.
  float pdf(const vec3& wi) const;
  ScatterResult sample(Rng& rng) const;

 private:
  FlakeParams params_;
  vec3 wo_;
};

}  // namespace farfield
