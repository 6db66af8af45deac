// SPDX-License-Identifier: Apache-2.0
// The phase function of fog: a medium that scatters by itself, not because it stands for surfaces. Clouds, smoke and
// their coarser levels, with the scalar self-shadowing of thesis 12.2.
//
// With A = self_shadowing, g the anisotropy, and S the shape of what a voxel stops:
//
//   albedo A f_g(wo, wi) + albedo_multiple (1 - A) f_S(wi)
//
//   f_g   Henyey and Greenstein's phase function; f_S if g is 0
//   f_S   sigma(wi) / (4 pi R_G(S)), sigma(w) = sqrt(w^T S w): isotropic for S = identity. Thesis 13.3's f_ms, the only
//         phase function of wi alone that is reciprocal to an attenuation of that shape
//   albedo_multiple = albedo cluster_albedo(albedo, A) (scattering/albedo.h): light that was scattered more than once
//         before it left the voxel. The thesis stores it (14.1.16); this needs no bytes and keeps white white
//
// f_g is not reciprocal where S is not the identity. The integral over wi is cluster_albedo(albedo, A), at most 1.
#pragma once

#include "base/random.h"
#include "base/vec.h"
#include "farfield/scatter_sample.h"
#include "scattering/sggx.h"

namespace farfield {

/// g of either sign is at most this: the float's steps at the peak are finer than the peak is wide.
inline constexpr float kMostFogAnisotropy = 0.98f;

/// Henyey and Greenstein's phase function, per steradian [Henyey and Greenstein 1941]. cosine: between the ways of the
/// light before and after; g in (-1, 1).
float henyey_greenstein(float cosine, float g);

/// Scattering parameters of a voxel in the space of the directions (world).
struct FogParams {
  vec3 albedo{1.0f};            ///< single scattering, linear RGB in [0, 1]
  float self_shadowing = 1.0f;  ///< A in (0, 1]; 1: none
  float anisotropy = 0.0f;      ///< g, within kMostFogAnisotropy
  bool has_shape = false;       ///< false: sggx is not looked at
  SymMat3 sggx;                 ///< S, any scale; 0 is taken as isotropic
};

/// Fog seen from wo, given that a collision happened. Directions are unit, away from the point; wo is where the light
/// goes. Immutable; any thread. No allocation.
class FogPhase {
 public:
  FogPhase(const FogParams& params, const vec3& wo);
  /// albedo * phase function, per steradian. rng is not used: the interface is FlakeModel's.
  vec3 eval(const vec3& wi, Rng& rng) const;
  /// Density of sample(), per steradian; exact.
  float pdf(const vec3& wi) const;
  /// weight = albedo * phase / pdf, at most the larger of both albedos.
  ScatterSample sample(Rng& rng) const;

 private:
  /// Parts of the density of wi: of light that was scattered once, and more often.
  struct Split {
    float single, multiple;
  };
  Split densities(const vec3& wi) const;
  float shape_density(const vec3& wi) const;

  CholeskyFactor<float> shape_;
  float shape_norm_ = 0;  ///< 1 / (4 pi R_G); 0: no shape
  vec3 wo_;
  vec3 single_, multiple_;  ///< albedos
  float share_ = 1;         ///< A
  float g_ = 0;
};

}  // namespace farfield
