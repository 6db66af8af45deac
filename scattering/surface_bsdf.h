// SPDX-License-Identifier: Apache-2.0
// The reflectance of prefiltered surfaces: ellipsoid-NDF microfacets, diffuse and specular, and diffuse transmission
// (thesis 8.3.9-8.3.11, formula notes section 6). Surfaces are two-sided.
#pragma once

#include "base/random.h"
#include "base/vec.h"
#include "scattering/scatter_sample.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// Reflectance parameters of a face in the space of the directions (world). Albedos in [0, 1], linear RGB.
struct SurfaceParams {
  SymMat3 sggx;  ///< distribution of normals, any scale; specular lobe: specular_sggx(sggx, roughness2)
  vec3 diffuse{0.0f};
  vec3 specular{0.0f};  ///< F0; Schlick's Fresnel; 0 means no specular lobe at all
  vec3 transmission{0.0f};
  float roughness2 = 1.0f;
};

/// A face seen from wo. Directions are unit, away from the point. Immutable; any thread. At most 160 bytes, no
/// allocation.
class SurfaceBsdf {
 public:
  /// n: unit geometric normal with n.wo >= 0. wo at grazing (n.wo == 0) gives a black surface.
  SurfaceBsdf(const SurfaceParams& params, const vec3& n, const vec3& wo);
  /// f |cos|; an unbiased one-sample estimate where diffuse microfacets have no closed form (rng).
  vec3 eval(const vec3& wi, Rng& rng) const;
  /// Exact density of sample(), per steradian.
  float pdf(const vec3& wi) const;
  ScatterResult sample(Rng& rng) const;

 private:
  SurfaceParams params_;
  vec3 n_;
  vec3 wo_;
};

}  // namespace farfield
