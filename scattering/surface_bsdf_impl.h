// SPDX-License-Identifier: Apache-2.0
// SurfaceModel's functions, for who instantiates it: surface_bsdf.cpp for products, tests/support for other sets of
// channels.
#pragma once

#include "scattering/albedo.h"
#include "scattering/highlight_lean.h"
#include "scattering/hot_spot.h"
#include "scattering/microfacet_brdf.h"
#include "scattering/surface_bsdf.h"

namespace farfield {

template <unsigned kChannels>
SurfaceModel<kChannels>::SurfaceModel(const SurfaceParams& params, const vec3& n, const vec3& wo)
    : n_(n), wo_(wo), cos_o_(glm::dot(n, wo)), hot_spot_(params.hot_spot) {
  if (!(cos_o_ > 0)) return;
  if constexpr (kHasDiffuse) diffuse_ = clamp_albedo(params.diffuse), diffuse_chance_ = max_component(diffuse_);
  if constexpr (kHasTransmission) {
    transmission_ = clamp_albedo(params.transmission), transmission_chance_ = max_component(transmission_);
  }
  if constexpr (kHasDiffuse && kHasTransmission) limit_sum(diffuse_, transmission_);
  if constexpr (kHasSpecular) couple_to_highlight(params);

  const float sum = specular_chance_ + diffuse_chance_ + transmission_chance_;
  if (!(sum > 0)) return;
  specular_chance_ /= sum, diffuse_chance_ /= sum, transmission_chance_ /= sum;
}

// Sets up the highlight and takes from the base what it returns, here where that depends on wo alone.
template <unsigned kChannels>
void SurfaceModel<kChannels>::couple_to_highlight(const SurfaceParams& params) requires((kChannels & kSpecular) != 0) {
  const Highlight highlight(params.specular, params.roughness2);
  if (!highlight.exists()) return;
  const HighlightShare share = highlight.share(cos_o_);
  const float alpha = highlight.alpha();
  specular_ = {highlight, Microfacets(specular_sggx(SymMat3::outer(n_), alpha * alpha), n_),
               highlight.multiple_lobe() * (1 - share.all)};

  const vec3 returned = highlight.albedo(share), once = highlight.once(share);
  if (params.highlight_lean != 0 || params.highlight_opening != 1) {
    vec3 base(0.0f);
    if constexpr (kHasDiffuse) base += diffuse_;
    if constexpr (kHasTransmission) base += transmission_;
    specular_.albedo = layered_albedo(returned, base);
    specular_.lean = params.highlight_lean, specular_.opening = params.highlight_opening;
  }
  const float left = 1 - min_component(returned);
  specular_chance_ = max_component(once);
  diffuse_chance_ = diffuse_chance_ * left + max_component(returned - once);
  transmission_chance_ *= left;
  const vec3 coupling = (vec3(1.0f) - returned) / glm::max(vec3(1.0f) - highlight.mean_albedo(), vec3(1e-6f));
  if constexpr (kHasDiffuse) diffuse_ *= coupling;
  if constexpr (kHasTransmission) transmission_ *= coupling;
}

template <unsigned kChannels>
vec3 SurfaceModel<kChannels>::eval(const vec3& wi) const {
  if (!(specular_chance_ + diffuse_chance_ + transmission_chance_ > 0)) return vec3(0.0f);
  const float cos_i = glm::dot(n_, wi);
  vec3 base(0.0f), highlight(0.0f);
  if constexpr (kHasDiffuse) {
    if (cos_i > 0) base = diffuse_;
  }
  if constexpr (kHasTransmission) {
    if (cos_i < 0) base = transmission_;
  }
  if (hot_spot_ > 0 && cos_i > 0) base *= hot_spot(hot_spot_, glm::dot(wo_, wi), cos_o_);
  if constexpr (kHasSpecular) {
    if (specular_.highlight.exists()) {
      const HighlightShare share = specular_.highlight.share(std::abs(cos_i));
      base *= vec3(1.0f) - specular_.highlight.albedo(share);
      if (cos_i > 0) {
        base += specular_.multiple * (1 - share.all);
        highlight = eval_specular_facets<Masking::HeightCorrelated>(
            specular_.facets, wo_, cos_o_, wi, cos_i, [this](float cos) { return specular_.highlight.fresnel(cos); });
        if (specular_.lean != 0 || specular_.opening != 1)
          highlight *=
              odds_gain(specular_.albedo, specular_.opening * highlight_leaning(specular_.lean, glm::dot(wo_, wi)));
      }
    }
  }
  return base * (std::abs(cos_i) * kInvPi) + highlight;
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
vec3 SurfaceModel<kChannels>::sample_direction(Rng& rng) const {
  if (!(specular_chance_ + diffuse_chance_ + transmission_chance_ > 0)) return vec3(0.0f);
  const float lobe = rng.next(), u1 = rng.next(), u2 = rng.next();
  if constexpr (kHasSpecular) {
    if (lobe < specular_chance_) {
      const vec3 wi = reflect_about(wo_, specular_.facets.sample_visible(wo_, u1, u2));
      return glm::dot(n_, wi) > 0 ? wi : vec3(0.0f);
    }
  }
  const bool through = kHasTransmission && transmission_chance_ > 0 && !(lobe < specular_chance_ + diffuse_chance_);
  return cosine_lobe(through ? -n_ : n_, u1, u2);
}

template <unsigned kChannels>
ScatterSample SurfaceModel<kChannels>::sample(Rng& rng) const {
  ScatterSample result;
  result.wi = sample_direction(rng);
  if (result.wi == vec3(0.0f)) return {};
  result.pdf = pdf(result.wi);
  if (result.pdf > 0) result.weight = eval(result.wi) / result.pdf;
  return result;
}

}  // namespace farfield
