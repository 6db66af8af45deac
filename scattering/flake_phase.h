// SPDX-License-Identifier: Apache-2.0
// The phase function of prefiltered volumes: SGGX microflakes, diffuse, specular and transmitting, with isotropic
// self-shadowing [Heitz et al. 2015] (thesis 12.2, 13.3).
//
// With A = self_shadowing, sigma(w) = sqrt(w^T S w), and m the flakes of sggx visible from wo:
//
//   A E_m[ f_m(wo, wi) |wi.m| ] + (1 - A) albedo_ms (1 + wo.wi) sigma(wi) / (4 pi R_G)
//
// f_m is the BRDF (and transmission) of a flat surface with normal m and the voxel's reflectance: a flake scatters as
// the piece of surface that it stands for (docs/decisions/0007). With a = R + (1 - R)(diffuse + transmission), what a
// flake returns of light from everywhere, R by its highlight, albedo_ms = a cluster_albedo(a, A) (scattering/albedo.h):
// light that meets another flake close by is coloured again. The thesis stores albedo_ms per voxel instead (14.1.16);
// this needs no bytes and keeps white white.
//
// Reciprocal in the sense of anisotropic media, sigma(wo) f(wo, wi) = sigma(wi) f(wi, wo), but for the hot spot, for
// highlights that lean and for open sides (scattering/hot_spot.h, highlight_lean.h, open_side.h), and of light that
// goes through these; the integral over wi is at most 1, and 1 where diffuse + transmission = 1.
#pragma once

#include "base/random.h"
#include "base/vec.h"
#include "farfield/scatter_sample.h"
#include "scattering/channels.h"
#include "scattering/sggx.h"
#include "scattering/surface_bsdf.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// Scattering parameters of a voxel in the space of the directions (world). diffuse + transmission above 1 is scaled
/// down to 1.
struct FlakeParams {
  SymMat3 sggx;  ///< of the flakes, each a flat surface; any scale. 0: taken as isotropic
  vec3 diffuse{0.0f};
  vec3 specular{0.0f};  ///< F0
  vec3 transmission{0.0f};
  float roughness2 = 1.0f;
  float self_shadowing = 1.0f;  ///< A in (0, 1]; 1: none
  float hot_spot = 0.0f;        ///< strength in [0, kStrongestHotSpot] (scattering/hot_spot.h); 0: none
  float highlight_lean = 0.0f;  ///< at most kMostHighlightLean, either way (scattering/highlight_lean.h); 0: none
  vec3 open_side{0.0f};         ///< at most kMostOpenSide long (scattering/open_side.h); 0: both sides are alike
};

/// A voxel's scattering seen from wo, given that a collision happened, with the given channels (scattering/channels.h);
/// parameters of the others are not looked at. Directions are unit, away from the point. Immutable; any thread. At most
/// 160 bytes, no allocation.
template <unsigned kChannels>
class FlakeModel {
 public:
  FlakeModel(const FlakeParams& params, const vec3& wo);
  /// albedo * phase function; an unbiased one-sample estimate (rng chooses the flake).
  vec3 eval(const vec3& wi, Rng& rng) const;
  /// The density that multiple importance sampling uses for sample(), per steradian: normalised, and close to the
  /// density of sample(). It is exact for mirrors, for flat and for isotropic diffuse flakes, and for multiple
  /// scattering; the rest has no closed form. Weights made from it sum to one, so estimates stay unbiased as long as
  /// `weight` below is used.
  float pdf(const vec3& wi) const;
  /// weight = albedo * phase / true density of the sample (for diffuse flakes without hot spot the albedo itself);
  /// `pdf` = pdf(wi).
  ScatterSample sample(Rng& rng) const;

 private:
  static constexpr bool kHasDiffuse = (kChannels & kDiffuse) != 0;
  static constexpr bool kHasSpecular = (kChannels & kSpecular) != 0;
  static constexpr bool kHasTransmission = (kChannels & kTransmission) != 0;
  static constexpr bool kHasMultiple = (kChannels & kSelfShadowing) != 0;

  /// What only specular flakes need.
  struct Specular {
    CholeskyFactor<float> facets;  ///< of specular_sggx(sggx, roughness2), for pdf()
    vec3 f0{0.0f};                 ///< 0: these flakes have no highlight
    float roughness2 = 1;
    float lean = 0;
  };
  /// What only self-shadowing needs.
  struct Multiple {
    vec3 albedo{0.0f};
    float norm = 0;   ///< 1 / (4 pi R_G)
    float share = 0;  ///< 1 - A
  };
  /// How often each kind of event is expected.
  struct Chances {
    float specular = 0, diffuse = 0, transmission = 0, multiple = 0;
  };

  using Flake = SurfaceModel<kChannels & kSurfaceChannels>;

  // Constraints in terms of kChannels alone: clang 14 does not find members of the class in those of a definition
  // outside.
  vec3 set_up_specular(const FlakeParams& params, const SymMat3& s) requires((kChannels & kSpecular) != 0);
  void set_up_multiple(const FlakeParams& params, const SymMat3& s,
                       const vec3& highlight) requires((kChannels & kSelfShadowing) != 0);
  float single_share() const;
  float multiple_density(const vec3& wi) const requires((kChannels & kSelfShadowing) != 0);
  bool scatters_once() const { return chances_.specular + chances_.diffuse + chances_.transmission > 0; }
  Flake sample_flake(Rng& rng) const;
  void open(const vec3& normal, SurfaceParams& params) const;

  CholeskyFactor<float> flakes_;
  vec3 wo_;
  float hot_spot_ = 0;
  vec3 open_side_;
  Chances chances_;
  [[no_unique_address]] PartIf<kHasDiffuse, vec3> diffuse_{};
  [[no_unique_address]] PartIf<kHasTransmission, vec3> transmission_{};
  [[no_unique_address]] PartIf<kHasSpecular, Specular> specular_{};
  [[no_unique_address]] PartIf<kHasMultiple, Multiple> multiple_{};
};

/// The model with all channels, for hosts that do not choose.
class FlakePhase : public FlakeModel<kFlakeChannels> {
 public:
  using FlakeModel::FlakeModel;
};

}  // namespace farfield
