// SPDX-License-Identifier: Apache-2.0
// FlakeModel's functions, for who instantiates it: flake_phase.cpp for products, tests/support for other sets of
// channels.
#pragma once

#include "scattering/flake_phase.h"

#include "scattering/albedo.h"
#include "scattering/carlson.h"
#include "scattering/highlight.h"
#include "scattering/open_side.h"

#include <limits>

namespace farfield {
namespace detail {

/// The isotropic share that the closed-form density keeps for flat flakes, so that it is positive all around.
inline constexpr float kSmallestSpread = 0.01f;

/// Smaller A is taken as this one: white flakes must not divide 0 by 0.
inline constexpr float kLeastSelfShadowing = 1e-4f;

/// S at unit trace, so that no scale under- or overflows; isotropic for an empty or broken S.
inline SymMat3 usable_sggx(const SymMat3& s) {
  const float trace = s.trace();
  const bool usable = trace > std::numeric_limits<float>::min() && std::isfinite(trace + s.xy + s.xz + s.yz);
  return usable ? s * (1.0f / trace) : SymMat3::identity();
}

/// The phase function of a diffuse sphere, which is that of isotropic diffuse flakes. c: cosine between wo and wi.
inline float sphere_phase(float c) {
  c = std::clamp(c, -1.0f, 1.0f);
  const float angle = std::acos(c);
  return 2.0f / (3.0f * kPi * kPi) * (std::sqrt(1.0f - c * c) + (kPi - angle) * c);
}

/// Stands for E_m [<wi.m>] / pi: exact for flat and for isotropic flakes, in between a mix of the two about the mean
/// visible normal S wo, by how far S wo falls short of what flat flakes would have.
inline float diffuse_density(const CholeskyFactor<float>& b, const vec3& wo, const vec3& wi) {
  const vec3 x = b.transposed_times(wo);
  const vec3 mean = b * x;
  const float mean2 = glm::dot(mean, mean);
  const float flatness = mean2 / (glm::dot(x, x) * b.trace_of_s());
  const float spread = std::clamp(1.5f * (1.0f - flatness), kSmallestSpread, 1.0f);
  const float c = glm::dot(mean, wi) / std::sqrt(mean2);
  return (1.0f - spread) * std::max(c, 0.0f) * kInvPi + spread * sphere_phase(c);
}

}  // namespace detail

template <unsigned kChannels>
FlakeModel<kChannels>::FlakeModel(const FlakeParams& params, const vec3& wo)
    : wo_(wo), hot_spot_(params.hot_spot), open_side_(params.open_side) {
  const SymMat3 s = detail::usable_sggx(params.sggx);
  flakes_ = cholesky(s);
  if constexpr (kHasDiffuse) diffuse_ = clamp_albedo(params.diffuse), chances_.diffuse = max_component(diffuse_);
  if constexpr (kHasTransmission) {
    transmission_ = clamp_albedo(params.transmission), chances_.transmission = max_component(transmission_);
  }
  if constexpr (kHasDiffuse && kHasTransmission) limit_sum(diffuse_, transmission_);
  [[maybe_unused]] vec3 highlight(0.0f);
  if constexpr (kHasSpecular) highlight = set_up_specular(params, s);
  if constexpr (kHasMultiple) set_up_multiple(params, s, highlight);

  const float single = chances_.specular + chances_.diffuse + chances_.transmission;
  const float share = single > 0 ? single_share() / single : 0.0f;
  chances_.specular *= share, chances_.diffuse *= share, chances_.transmission *= share;
}

// Returns what the highlight gives back of light from everywhere.
template <unsigned kChannels>
vec3 FlakeModel<kChannels>::set_up_specular(const FlakeParams& params,
                                            const SymMat3& s) requires((kChannels & kSpecular) != 0) {
  const float roughness2 = params.roughness2 < 1.0f ? std::max(params.roughness2, 0.0f) : 1.0f;
  const Highlight highlight(params.specular, roughness2);
  if (!highlight.exists()) return vec3(0.0f);
  specular_ = {cholesky(specular_sggx(s, roughness2)), clamp_albedo(params.specular), roughness2,
               params.highlight_lean};

  const vec3 mean = highlight.mean_albedo();
  const float left = 1.0f - min_component(mean);
  chances_.specular = max_component(mean);
  chances_.diffuse *= left, chances_.transmission *= left;
  return mean;
}

template <unsigned kChannels>
void FlakeModel<kChannels>::set_up_multiple(const FlakeParams& params, const SymMat3& s,
                                            const vec3& highlight) requires((kChannels & kSelfShadowing) != 0) {
  if (!(params.self_shadowing < 1)) return;
  vec3 base(0.0f);
  if constexpr (kHasDiffuse) base += diffuse_;
  if constexpr (kHasTransmission) base += transmission_;
  const float a = std::max(params.self_shadowing, detail::kLeastSelfShadowing);
  const vec3 albedo = layered_albedo(highlight, base);
  multiple_.albedo = albedo * cluster_albedo(albedo, a);
  if (!(max_component(multiple_.albedo) > 0)) return;
  const vec3 eigen(eigenvalues(s));
  multiple_.norm = 1.0f / (4.0f * kPi * carlson_rg(eigen.x, eigen.y, eigen.z));
  multiple_.share = 1.0f - a;
  chances_.multiple = multiple_.share;
}

template <unsigned kChannels>
float FlakeModel<kChannels>::single_share() const {
  if constexpr (kHasMultiple) return 1.0f - multiple_.share;
  return 1.0f;
}

// One of the flakes visible from wo, as the flat surface that it is.
template <unsigned kChannels>
typename FlakeModel<kChannels>::Flake FlakeModel<kChannels>::sample_flake(Rng& rng) const {
  const float u1 = rng.next(), u2 = rng.next();
  const vec3 m = Sggx(flakes_).sample_visible(wo_, u1, u2);
  SurfaceParams params;
  if constexpr (kHasDiffuse) params.diffuse = diffuse_;
  if constexpr (kHasTransmission) params.transmission = transmission_;
  if constexpr (kHasSpecular) {
    params.specular = specular_.f0, params.roughness2 = specular_.roughness2;
    params.highlight_lean = specular_.lean;
  }
  if (open_side_ != vec3(0.0f)) open(m, params);
  params.hot_spot = hot_spot_;
  return Flake(params, m, wo_);
}

template <unsigned kChannels>
void FlakeModel<kChannels>::open(const vec3& normal, SurfaceParams& params) const {
  params.highlight_opening = side_opening(open_side_, normal);
  const vec3 gain = odds_gain(params.diffuse + params.transmission, params.highlight_opening);
  params.diffuse *= gain, params.transmission *= gain;
}

template <unsigned kChannels>
float FlakeModel<kChannels>::multiple_density(const vec3& wi) const requires((kChannels & kSelfShadowing) != 0) {
  return multiple_.norm * Sggx(flakes_).sigma(wi) * (1.0f + glm::dot(wo_, wi));
}

template <unsigned kChannels>
vec3 FlakeModel<kChannels>::eval(const vec3& wi, [[maybe_unused]] Rng& rng) const {
  vec3 value(0.0f);
  if (scatters_once()) value = single_share() * sample_flake(rng).eval(wi);
  if constexpr (kHasMultiple) {
    value += multiple_.share * multiple_density(wi) * multiple_.albedo;
  }
  return value;
}

template <unsigned kChannels>
float FlakeModel<kChannels>::pdf(const vec3& wi) const {
  float density = 0;
  if constexpr (kHasSpecular) {
    if (chances_.specular > 0) density += chances_.specular * Sggx(specular_.facets).specular_phase(wo_, wi);
  }
  if constexpr (kHasDiffuse) {
    if (chances_.diffuse > 0) density += chances_.diffuse * detail::diffuse_density(flakes_, wo_, wi);
  }
  if constexpr (kHasTransmission) {
    if (chances_.transmission > 0) density += chances_.transmission * detail::diffuse_density(flakes_, wo_, -wi);
  }
  if constexpr (kHasMultiple) density += chances_.multiple * multiple_density(wi);
  return density;
}

template <unsigned kChannels>
ScatterSample FlakeModel<kChannels>::sample(Rng& rng) const {
  ScatterSample result;
  if constexpr (kHasMultiple) {
    if (chances_.multiple > 0 && rng.next() < chances_.multiple) {
      result.wi = Sggx(flakes_).sample_sigma(rng);
      // of wi and -wi, which are as likely, the one by 1 + wo.wi
      if (2.0f * rng.next() >= 1.0f + glm::dot(wo_, result.wi)) result.wi = -result.wi;
      result.weight = multiple_.albedo;  // chosen with probability 1 - A, which is its share
      result.pdf = pdf(result.wi);
      return result;
    }
  }
  if (!scatters_once()) return {};
  result = sample_flake(rng).sample(rng);  // chosen with probability A, which is its share
  if (result.pdf > 0) result.pdf = pdf(result.wi);
  return result;
}

}  // namespace farfield
