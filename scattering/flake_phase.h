// SPDX-License-Identifier: Apache-2.0
// The phase function of prefiltered volumes: SGGX microflakes, diffuse, specular and transmitting, with isotropic
// self-shadowing (Heitz et al. 2015; thesis 12.2, 13.3).
//
// With A = self_shadowing, sigma(w) = sqrt(w^T S w), and m the flakes of sggx visible from wo:
//
//   A (specular + diffuse + transmission) + (1 - A) albedo_ms sigma(wi) / (4 pi R_G)
//   specular      F D'(h) g(wi) / (4 sigma'(wo)),  ' = of specular_sggx(sggx, roughness2), g = sigma / sigma', scaled
//   to
//                 max g = 1: a masking factor, which makes sigma(wo) f(wo, wi) symmetric; 1 if roughness2 = 0
//   diffuse       E_m [ diffuse c(wo) c(wi) <wi.m> / pi ],  c(w) = (1 - F(w.m)) / sqrt(1 - mean F), F Schlick's Fresnel
//   transmission  the same with <-wi.m>
//   albedo_ms     mean F + (1 - mean F)(diffuse + transmission): what a flake reflects of light from everywhere
//
// Reciprocal in the sense of anisotropic media, sigma(wo) f(wo, wi) = sigma(wi) f(wi, wo); the integral over wi is at
// most 1, and exactly 1 where diffuse + transmission = 1 and specular = 0.
#pragma once

#include "base/random.h"
#include "base/vec.h"
#include "scattering/scatter_sample.h"
#include "scattering/sggx.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// Scattering parameters of a voxel in the space of the directions (world). diffuse + transmission above 1 is scaled
/// down to 1.
struct FlakeParams {
  SymMat3 sggx;  ///< any scale; specular flakes: specular_sggx(sggx, roughness2). 0: taken as isotropic
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
  /// The density that multiple importance sampling uses for sample(), per steradian: normalised, and close to the
  /// density of sample(). It is exact for specular, flat, isotropic and multiple scattering; between those, diffuse
  /// flakes have no closed form. Weights made from it sum to one, so estimates stay unbiased as long as `weight` below
  /// is used.
  float pdf(const vec3& wi) const;
  /// weight = albedo * phase / true density of the sample (albedo itself for white diffuse flakes); `pdf` = pdf(wi).
  ScatterResult sample(Rng& rng) const;

 private:
  /// How often sample() picks each kind of event.
  struct Chances {
    float specular = 0, diffuse = 0, transmission = 0, multiple = 0;
  };

  vec3 specular_value(const vec3& wi) const;
  vec3 base_value(const vec3& flake, float cos_i) const;
  float specular_masking(const vec3& wi) const;

  CholeskyFactor<float> flakes_;
  CholeskyFactor<float> specular_flakes_;  ///< scaled so that g <= 1; valid if chances_.specular > 0
  vec3 wo_;
  vec3 diffuse_{0.0f}, specular_{0.0f}, transmission_{0.0f}, multiple_{0.0f};
  float self_shadowing_ = 1;
  float f90_ = 0;
  float multiple_norm_ = 0;  ///< 1 / (4 pi R_G); 0 if self_shadowing is 1
  Chances chances_;
};

}  // namespace farfield
