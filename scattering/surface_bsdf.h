// SPDX-License-Identifier: Apache-2.0
// The reflectance of faces: a GGX highlight over a Lambertian base that reflects and transmits (docs/theory.md, section
// 5). Surfaces are two-sided.
//
//   highlight     F D(h) G2 / (4 n.wo n.wi) + multiple (1 - E(wo)) (1 - E(wi)) / pi
//   base          c(wo) c(wi) diffuse / pi, and the same to the other side with transmission
//
// E is what the highlight returns of white facets after one reflection, and its second term what facets reflect onto
// each other [Kulla and Conty 2017]. c(w) = 1 - (what the highlight returns of light from w), over the square root of
// its mean: the light that it leaves is there for the base [Kelemen and Szirmay-Kalos 2001]. So all are reciprocal, the
// albedos sum to at most 1 for every wo, and to 1 where the base absorbs nothing.
#pragma once

#include "base/random.h"
#include "base/vec.h"
#include "farfield/scatter_sample.h"
#include "scattering/channels.h"
#include "scattering/highlight.h"
#include "scattering/microfacet.h"

namespace farfield {

/// Reflectance parameters of a face. Albedos in [0, 1], linear RGB. diffuse + transmission above 1 is scaled down to 1.
struct SurfaceParams {
  vec3 diffuse{0.0f};   ///< of the light that the highlight leaves; so is transmission
  vec3 specular{0.0f};  ///< F0; Schlick's Fresnel; 0 means no highlight at all
  vec3 transmission{0.0f};
  float roughness2 = 1.0f;      ///< alpha^2
  float hot_spot = 0.0f;        ///< of the diffuse part, in [0, kStrongestHotSpot]: for flakes (scattering/hot_spot.h)
  float highlight_lean = 0.0f;  ///< at most kMostHighlightLean: for flakes (scattering/highlight_lean.h)
  float highlight_opening = 1.0f;  ///< in [1 - kMostOpenSide, 1 + kMostOpenSide]: for flakes (scattering/open_side.h)
};

/// A face seen from wo, with the given channels (scattering/channels.h); parameters of the others are not looked at.
/// Directions are unit, away from the point. Immutable; any thread. At most 176 bytes, no allocation.
template <unsigned kChannels>
class SurfaceModel {
 public:
  /// n: unit normal with n.wo >= 0. wo at grazing (n.wo == 0) gives a black surface.
  SurfaceModel(const SurfaceParams& params, const vec3& n, const vec3& wo);
  /// f |cos|.
  vec3 eval(const vec3& wi) const;
  /// Exact density of sample(), per steradian.
  float pdf(const vec3& wi) const;
  ScatterSample sample(Rng& rng) const;
  /// Its direction alone; 0 for a failed sample.
  vec3 sample_direction(Rng& rng) const;

 private:
  static constexpr bool kHasDiffuse = (kChannels & kDiffuse) != 0;
  static constexpr bool kHasSpecular = (kChannels & kSpecular) != 0;
  static constexpr bool kHasTransmission = (kChannels & kTransmission) != 0;

  /// What only the highlight needs.
  struct Specular {
    Highlight highlight;
    Microfacets facets;   ///< valid if the highlight exists
    vec3 multiple{0.0f};  ///< times (1 - E(wi)) / pi: what facets reflect onto each other
    vec3 albedo{0.0f};    ///< of the whole surface; set if not all of the highlight gets away alike
    float lean = 0, opening = 1;
  };

  void couple_to_highlight(const SurfaceParams& params) requires((kChannels & kSpecular) != 0);

  vec3 n_, wo_;
  float cos_o_;
  float hot_spot_ = 0;
  float specular_chance_ = 0;  ///< how often sample() picks the lobe; all 0: black
  float diffuse_chance_ = 0;   ///< cosine lobes: the base's, and that of several facets
  float transmission_chance_ = 0;
  [[no_unique_address]] PartIf<kHasDiffuse, vec3> diffuse_{};
  [[no_unique_address]] PartIf<kHasTransmission, vec3> transmission_{};
  [[no_unique_address]] PartIf<kHasSpecular, Specular> specular_{};
};

/// The model with all channels, for hosts that do not choose.
class SurfaceBsdf : public SurfaceModel<kSurfaceChannels> {
 public:
  using SurfaceModel::SurfaceModel;
};

}  // namespace farfield
