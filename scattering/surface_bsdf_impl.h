// SPDX-License-Identifier: Apache-2.0
// SurfaceModel's functions, for who instantiates it: surface_bsdf.cpp for products, tests/support for other sets of
// channels.
#pragma once

#include "scattering/surface_bsdf.h"

#include "scattering/albedo.h"
#include "scattering/fresnel.h"
#include "scattering/microfacet_brdf.h"

namespace farfield {
namespace detail {

/// Up to this share of tr(S) away from n n^T, normals count as equal to n: 0.2 degrees, where the lobes cannot be told
/// apart. Larger than what packing to 12 bytes does to n n^T.
inline constexpr float kFlatShare = 1e-5f;
/// Smoother specular lobes are rendered as this one (alpha = 0.001).
inline constexpr float kSmallestRoughness2 = 1e-6f;

inline bool is_flat_sggx(const SymMat3& s, const vec3& n) {
  const float trace = s.trace();
  return !(trace - s.quadratic(n) > kFlatShare * trace);
}

inline vec3 reflectance(const vec3& f0, float f90, float grazing_share) {
  return f0 + (vec3(f90) - f0) * grazing_share;
}

/// The roughness that a distribution shows on a surface with normal n: that of GGX with as much spread.
inline float effective_alpha(const SymMat3& s, const vec3& n) {
  const float upright = s.quadratic(n);
  const float spread = s.trace() - upright;
  return spread < 2.0f * upright ? std::sqrt(std::max(0.0f, spread / (2.0f * upright))) : 1.0f;
}

}  // namespace detail

template <unsigned kChannels>
SurfaceModel<kChannels>::SurfaceModel(const SurfaceParams& params, const vec3& n, const vec3& wo)
    : n_(n), wo_(wo), cos_o_(glm::dot(n, wo)) {
  if (!(cos_o_ > 0)) return;
  if constexpr (kHasDiffuse) diffuse_ = clamp_albedo(params.diffuse), diffuse_chance_ = max_component(diffuse_);
  if constexpr (kHasTransmission) {
    transmission_ = clamp_albedo(params.transmission), transmission_chance_ = max_component(transmission_);
  }
  if constexpr (kHasDiffuse && kHasTransmission) limit_sum(diffuse_, transmission_);
  if constexpr (kHasNormals) is_flat_ = detail::is_flat_sggx(params.sggx, n);
  if constexpr (kHasNormals && kHasBase) {
    if (!is_flat_ && diffuse_chance_ + transmission_chance_ > 0) base_facets_ = Microfacets(params.sggx, n);
  }
  if constexpr (kHasSpecular) couple_to_specular(params);

  const float sum = specular_chance_ + diffuse_chance_ + transmission_chance_;
  if (!(sum > 0)) return;
  specular_chance_ /= sum, diffuse_chance_ /= sum, transmission_chance_ /= sum;
}

template <unsigned kChannels>
bool SurfaceModel<kChannels>::is_flat() const {
  return !kHasNormals || is_flat_;
}

template <unsigned kChannels>
vec3 SurfaceModel<kChannels>::fresnel(float cos) const requires(kHasSpecular) {
  return schlick(specular_.f0, specular_.f90, cos);
}

// Sets up the specular lobe and takes from the others what it reflects, here where that depends on wo alone.
template <unsigned kChannels>
void SurfaceModel<kChannels>::couple_to_specular(const SurfaceParams& params) requires(kHasSpecular) {
  const vec3 f0 = clamp_albedo(params.specular);
  const float f90 = grazing_reflectance(f0);
  if (!(f90 > 0)) return;
  const float roughness2 = params.roughness2 < 1.0f ? std::max(params.roughness2, detail::kSmallestRoughness2) : 1.0f;
  const SymMat3 lobe = specular_sggx(is_flat() ? SymMat3::outer(n_) : params.sggx, roughness2);
  const float alpha = is_flat() ? std::sqrt(roughness2) : detail::effective_alpha(lobe, n_);
  specular_ = {Microfacets(lobe, n_), f0, f90, alpha};

  const VisibleFresnel visible(alpha);
  const vec3 reflected = detail::reflectance(f0, f90, visible.grazing_share(cos_o_));
  specular_chance_ = max_component(reflected);
  const float left = 1 - min_component(reflected);
  diffuse_chance_ *= left, transmission_chance_ *= left;
  const vec3 left_in_all = vec3(1.0f) - detail::reflectance(f0, f90, visible.mean_grazing_share());
  const vec3 coupling = (is_flat() ? vec3(1.0f) - reflected : vec3(1.0f)) / glm::max(left_in_all, vec3(1e-6f));
  if constexpr (kHasDiffuse) diffuse_ *= coupling;
  if constexpr (kHasTransmission) transmission_ *= coupling;
}

template <unsigned kChannels>
vec3 SurfaceModel<kChannels>::eval(const vec3& wi, Rng& rng) const {
  const float cos_i = glm::dot(n_, wi);
  vec3 value(0.0f);
  if (cos_i > 0) {
    if constexpr (kHasSpecular) {
      if (specular_chance_ > 0) {
        value += eval_specular_facets<Masking::HeightCorrelated>(specular_.facets, wo_, cos_o_, wi, cos_i,
                                                                 [this](float cos) { return fresnel(cos); });
      }
    }
    if constexpr (kHasDiffuse) {
      if (diffuse_chance_ > 0) value += diffuse_ * eval_base(wi, cos_i, rng);
    }
  } else if (cos_i < 0) {
    if constexpr (kHasTransmission) {
      if (transmission_chance_ > 0) value += transmission_ * eval_base(wi, cos_i, rng);
    }
  }
  return value;
}

// The diffuse lobe for albedo 1, on the side of wi, coupled to the specular one.
template <unsigned kChannels>
vec3 SurfaceModel<kChannels>::eval_base(const vec3& wi, float cos_i, [[maybe_unused]] Rng& rng) const
    requires(kHasBase) {
  if constexpr (kHasNormals) {
    if (!is_flat_) {
      const vec3 facet = base_facets_.sample_visible(wo_, rng.next(), rng.next());
      vec3 value(eval_diffuse_facet<Masking::HeightCorrelated>(base_facets_, wo_, cos_o_, wi, cos_i, facet));
      if constexpr (kHasSpecular) {
        if (specular_.f90 > 0) value *= left_by_specular(wo_, rng) * left_by_specular(cos_i > 0 ? wi : -wi, rng);
      }
      return value;
    }
  }
  vec3 value(std::abs(cos_i) * kInvPi);
  if constexpr (kHasSpecular) {
    if (specular_.f90 > 0) {
      const float share = VisibleFresnel(specular_.alpha).grazing_share(std::abs(cos_i));
      value *= vec3(1.0f) - detail::reflectance(specular_.f0, specular_.f90, share);
    }
  }
  return value;
}

// 1 - F of one specular facet visible from w: its mean is exactly what specular reflection leaves, whatever sggx is.
template <unsigned kChannels>
vec3 SurfaceModel<kChannels>::left_by_specular(const vec3& w, Rng& rng) const requires(kHasSpecular) {
  const vec3 facet = specular_.facets.sample_visible(w, rng.next(), rng.next());
  return vec3(1.0f) - fresnel(std::max(0.0f, glm::dot(facet, w)));
}

template <unsigned kChannels>
float SurfaceModel<kChannels>::pdf(const vec3& wi) const {
  const float cos_i = glm::dot(n_, wi);
  if (!(cos_i > 0)) return transmission_chance_ * std::max(0.0f, -cos_i) * kInvPi;
  float density = diffuse_chance_ * cos_i * kInvPi;
  if constexpr (kHasSpecular) {
    if (specular_chance_ > 0) density += specular_chance_ * specular_facets_pdf(specular_.facets, wo_, wi, n_);
  }
  return density;
}

template <unsigned kChannels>
ScatterSample SurfaceModel<kChannels>::sample(Rng& rng) const {
  if (!(specular_chance_ + diffuse_chance_ + transmission_chance_ > 0)) return {};
  const float lobe = rng.next(), u1 = rng.next(), u2 = rng.next();
  ScatterSample result;
  const bool is_specular = kHasSpecular && lobe < specular_chance_;
  if (is_specular) {
    if constexpr (kHasSpecular) result.wi = reflect_about(wo_, specular_.facets.sample_visible(wo_, u1, u2));
    if (!(glm::dot(n_, result.wi) > 0)) return {};
  } else {
    const bool through = kHasTransmission && transmission_chance_ > 0 && !(lobe < specular_chance_ + diffuse_chance_);
    result.wi = cosine_lobe(through ? -n_ : n_, u1, u2);
  }
  result.pdf = pdf(result.wi);
  if (result.pdf > 0) result.weight = eval(result.wi, rng) / result.pdf;
  return result;
}

}  // namespace farfield
