// SPDX-License-Identifier: Apache-2.0
// The reflectance of prefiltered surfaces: ellipsoid-NDF microfacets, diffuse and specular, and diffuse transmission
// (thesis 8.3.9-8.3.11, formula notes section 6). Surfaces are two-sided.
//
//   specular      F D(h) G2 / (4 n.wo n.wi)            D of specular_sggx(sggx, roughness2)
//   diffuse       E_m [ diffuse c(wo) c(wi) <wi.m> G2 / G1u(wo) ] / (pi n.wi)
//   transmission  the same to the other side, with <-wi.m>, and masking on both sides independently
//
// m are the facets of sggx visible from wo. c(w) = 1 - (mean Fresnel of the specular facets visible from w), over the
// square root of its mean: the light that does not meet the specular lobe is there for the lobes underneath. So all
// three are reciprocal and their albedos sum to at most 1 for every wo; on a flat face a diffuse lobe alone is exactly
// Lambertian. What microfacets reflect onto each other is lost, as in the thesis.
#pragma once

#include "base/random.h"
#include "base/vec.h"
#include "farfield/scatter_sample.h"
#include "scattering/channels.h"
#include "scattering/microfacet.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// Reflectance parameters of a face in the space of the directions (world). Albedos in [0, 1], linear RGB.
/// diffuse + transmission above 1 is scaled down to 1.
struct SurfaceParams {
  SymMat3 sggx;  ///< distribution of normals, any scale; specular lobe: specular_sggx(sggx, roughness2)
  vec3 diffuse{0.0f};
  vec3 specular{0.0f};  ///< F0; Schlick's Fresnel; 0 means no specular lobe at all
  vec3 transmission{0.0f};
  float roughness2 = 1.0f;
};

/// A face seen from wo, with the given channels (scattering/channels.h); parameters of the others are not looked at.
/// Directions are unit, away from the point. Immutable; any thread. At most 160 bytes, no allocation.
template <unsigned kChannels>
class SurfaceModel {
 public:
  /// n: unit geometric normal with n.wo >= 0. wo at grazing (n.wo == 0) gives a black surface.
  SurfaceModel(const SurfaceParams& params, const vec3& n, const vec3& wo);
  /// f |cos|; an unbiased one-sample estimate where diffuse microfacets have no closed form (rng).
  vec3 eval(const vec3& wi, Rng& rng) const;
  /// Exact density of sample(), per steradian.
  float pdf(const vec3& wi) const;
  ScatterSample sample(Rng& rng) const;

 private:
  static constexpr bool kHasDiffuse = (kChannels & kDiffuse) != 0;
  static constexpr bool kHasSpecular = (kChannels & kSpecular) != 0;
  static constexpr bool kHasTransmission = (kChannels & kTransmission) != 0;
  static constexpr bool kHasBase = kHasDiffuse || kHasTransmission;
  static constexpr bool kHasNormals = (kChannels & kNormals) != 0;

  /// What only the specular lobe needs.
  struct Specular {
    Microfacets facets;  ///< valid if f90 > 0
    vec3 f0{0.0f};
    float f90 = 0;    ///< 0: this face has no specular lobe
    float alpha = 0;  ///< the lobe's roughness
  };

  bool is_flat() const;
  void couple_to_specular(const SurfaceParams& params) requires(kHasSpecular);
  vec3 fresnel(float cos) const requires(kHasSpecular);
  vec3 left_by_specular(const vec3& w, Rng& rng) const requires(kHasSpecular);
  vec3 eval_base(const vec3& wi, float cos_i, Rng& rng) const requires(kHasBase);

  vec3 n_, wo_;
  float cos_o_;
  float specular_chance_ = 0;  ///< how often sample() picks the lobe; all 0: black
  float diffuse_chance_ = 0;
  float transmission_chance_ = 0;
  [[no_unique_address]] PartIf<kHasDiffuse, vec3> diffuse_{};
  [[no_unique_address]] PartIf<kHasTransmission, vec3> transmission_{};
  [[no_unique_address]] PartIf<kHasSpecular, Specular> specular_{};
  [[no_unique_address]] PartIf<kHasNormals && kHasBase, Microfacets> base_facets_{};  ///< valid if not flat
  bool is_flat_ = true;  ///< sggx is n n^T: the base is Lambertian
};

/// The model with all channels, for hosts that do not choose.
class SurfaceBsdf : public SurfaceModel<kSurfaceChannels> {
 public:
  using SurfaceModel::SurfaceModel;
};

}  // namespace farfield
