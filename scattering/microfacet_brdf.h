// SPDX-License-Identifier: Apache-2.0
// The specular lobe of ellipsoid microfacets, for any Fresnel function and either masking (thesis 8.3.9-8.3.11 with the
// erratum of docs/theory.md, section 5: G1 in the denominator is the unclamped one, or nothing is reciprocal).
// cos_o = n.wo > 0, cos_i = n.wi. Values are f |cos_i|.
#pragma once

#include "scattering/microfacet.h"

namespace farfield {

/// Specular facets: F D G2 / (4 cos_o), cos_i > 0. fresnel: cosine to the facet -> reflectance, scalar or RGB.
template <Masking kMasking, typename T, typename Fresnel>
auto eval_specular_facets(const BasicMicrofacets<T>& facets, const Vec3<T>& wo, T cos_o, const Vec3<T>& wi, T cos_i,
                          const Fresnel& fresnel) -> decltype(fresnel(T(0))) {
  const Vec3<T> h = half_vector(wo, wi);
  const T cos_h = glm::dot(h, wo);
  const T area_o = facets.projected_area(wo);
  if (!(cos_h > 0) || !(area_o > 0)) return decltype(fresnel(T(0)))(0);
  const T weight = masking_weight<kMasking>(cos_o, area_o, cos_i, facets.projected_area(wi));
  return fresnel(cos_h) * (facets.ndf(h) * weight / (T(4) * area_o));
}

/// Density of wi = wo mirrored at a visible facet, D(h) / (4 a(wo)), on both sides of the surface.
template <typename T>
T specular_facets_pdf(const BasicMicrofacets<T>& facets, const Vec3<T>& wo, const Vec3<T>& wi, const Vec3<T>& n) {
  const Vec3<T> h = half_vector(wo, wi);
  const T area_o = facets.projected_area(wo);
  if (!(glm::dot(h, wo) > 0) || !(glm::dot(h, n) > 0) || !(area_o > 0)) return 0;
  return facets.ndf(h) / (T(4) * area_o);
}

}  // namespace farfield
