// SPDX-License-Identifier: Apache-2.0
#include "scattering/flake_phase.h"

#include "scattering/carlson.h"
#include "scattering/fresnel.h"

#include <limits>

namespace farfield {
namespace {

/// The isotropic share that the closed-form density keeps for flat flakes, so that it is positive all around.
constexpr float kSmallestSpread = 0.01f;

vec3 clamp_albedo(const vec3& albedo) {
  // fmax turns NaN into 0.
  return glm::min(vec3(std::fmax(0.0f, albedo.x), std::fmax(0.0f, albedo.y), std::fmax(0.0f, albedo.z)), vec3(1.0f));
}

/// The cosine-weighted mean of Schlick's Fresnel.
vec3 mean_schlick(const vec3& f0, float f90) { return f0 + (vec3(f90) - f0) * (1.0f / 21); }

/// S at unit trace, so that no scale under- or overflows; isotropic for an empty or broken S.
SymMat3 usable_sggx(const SymMat3& s) {
  const float trace = s.trace();
  const bool usable = trace > std::numeric_limits<float>::min() && std::isfinite(trace + s.xy + s.xz + s.yz);
  return usable ? s * (1.0f / trace) : SymMat3::identity();
}

/// The phase function of a diffuse sphere, which is that of isotropic diffuse flakes. c: cosine between wo and wi.
float sphere_phase(float c) {
  c = std::clamp(c, -1.0f, 1.0f);
  const float angle = std::acos(c);
  return 2.0f / (3.0f * kPi * kPi) * (std::sqrt(1.0f - c * c) + (kPi - angle) * c);
}

/// Stands for E_m [<wi.m>] / pi: exact for flat and for isotropic flakes, in between a mix of the two about the mean
/// visible normal S wo, by how far S wo falls short of what flat flakes would have.
float diffuse_density(const CholeskyFactor<float>& b, const vec3& wo, const vec3& wi) {
  const vec3 x = b.transposed_times(wo);
  const vec3 mean = b * x;
  const float mean2 = glm::dot(mean, mean);
  const float flatness = mean2 / (glm::dot(x, x) * b.trace_of_s());
  const float spread = std::clamp(1.5f * (1.0f - flatness), kSmallestSpread, 1.0f);
  const float c = glm::dot(mean, wi) / std::sqrt(mean2);
  return (1.0f - spread) * std::max(c, 0.0f) * kInvPi + spread * sphere_phase(c);
}

}  // namespace

template <unsigned kChannels>
FlakeModel<kChannels>::FlakeModel(const FlakeParams& params, const vec3& wo) : wo_(wo) {
  const SymMat3 s = usable_sggx(params.sggx);
  flakes_ = cholesky(s);
  if constexpr (kHasDiffuse) diffuse_ = clamp_albedo(params.diffuse), chances_.diffuse = max_component(diffuse_);
  if constexpr (kHasTransmission) {
    transmission_ = clamp_albedo(params.transmission), chances_.transmission = max_component(transmission_);
  }
  if constexpr (kHasDiffuse && kHasTransmission) {
    const vec3 excess = glm::max(vec3(1.0f), diffuse_ + transmission_);
    diffuse_ /= excess, transmission_ /= excess;
  }
  [[maybe_unused]] vec3 mean_fresnel(0.0f);
  if constexpr (kHasSpecular || kHasMultiple) {
    const bool has_specular = kHasSpecular && max_component(params.specular) > 0;
    const bool has_multiple = kHasMultiple && params.self_shadowing < 1;
    const vec3 eigen = has_specular || has_multiple ? vec3(eigenvalues(s)) : vec3(1.0f);
    if constexpr (kHasSpecular) mean_fresnel = couple_to_specular(params, s, eigen);
    if constexpr (kHasMultiple) set_up_multiple(params, eigen, mean_fresnel);
  }

  const float single = chances_.specular + chances_.diffuse + chances_.transmission;
  const float share = single > 0 ? single_share() / single : 0.0f;
  chances_.specular *= share, chances_.diffuse *= share, chances_.transmission *= share;
}

// Sets up the specular flakes and takes from the others what they reflect; returns their mean reflectance.
template <unsigned kChannels>
vec3 FlakeModel<kChannels>::couple_to_specular(const FlakeParams& params, const SymMat3& s,
                                               const vec3& eigen) requires(kHasSpecular) {
  const vec3 f0 = clamp_albedo(params.specular);
  const float f90 = grazing_reflectance(f0);
  if (!(f90 > 0)) return vec3(0.0f);
  const float roughness2 = params.roughness2 < 1.0f ? std::max(params.roughness2, 0.0f) : 1.0f;
  // sigma^2 / sigma'^2 = 1 / ((1 - r) + r tr(S) / sigma^2) is largest where sigma^2 is lambda_max.
  const float scale = 1.0f / ((1.0f - roughness2) + roughness2 * s.trace() / eigen.x);
  specular_ = {cholesky(specular_sggx(s, roughness2) * scale), f0, f90};

  const vec3 mean = mean_schlick(f0, f90);
  const vec3 left = glm::max(vec3(1e-6f), vec3(1.0f) - mean);
  chances_.specular = max_component(mean);
  chances_.diffuse *= max_component(left), chances_.transmission *= max_component(left);
  if constexpr (kHasDiffuse) diffuse_ /= left;
  if constexpr (kHasTransmission) transmission_ /= left;
  return mean;
}

// The diffuse albedos are those of flakes already divided by 1 - mean F.
template <unsigned kChannels>
void FlakeModel<kChannels>::set_up_multiple(const FlakeParams& params, const vec3& eigen,
                                            const vec3& mean_fresnel) requires(kHasMultiple) {
  if (!(params.self_shadowing < 1)) return;
  const vec3 left = glm::max(vec3(1e-6f), vec3(1.0f) - mean_fresnel);
  multiple_.albedo = mean_fresnel + left * left * (base_albedo(false) + base_albedo(true));
  if (!(max_component(multiple_.albedo) > 0)) return;
  multiple_.norm = 1.0f / (4.0f * kPi * carlson_rg(eigen.x, eigen.y, eigen.z));
  multiple_.share = 1.0f - std::max(params.self_shadowing, 0.0f);
  chances_.multiple = multiple_.share;
}

template <unsigned kChannels>
float FlakeModel<kChannels>::single_share() const {
  if constexpr (kHasMultiple) return 1.0f - multiple_.share;
  return 1.0f;
}

template <unsigned kChannels>
vec3 FlakeModel<kChannels>::base_albedo(bool through) const {
  if (through) {
    if constexpr (kHasTransmission) return transmission_;
  } else {
    if constexpr (kHasDiffuse) return diffuse_;
  }
  return vec3(0.0f);
}

// g(wi): what makes the specular lobe reciprocal.
template <unsigned kChannels>
float FlakeModel<kChannels>::masking(const vec3& wi) const requires(kHasSpecular) {
  return std::min(1.0f, Sggx(flakes_).sigma(wi) / Sggx(specular_.flakes).sigma(wi));
}

// c(wo) c(wi) of one flake, but for 1 / (1 - mean F), which the albedos hold.
template <unsigned kChannels>
vec3 FlakeModel<kChannels>::coupling([[maybe_unused]] const vec3& flake, [[maybe_unused]] float cos_i) const {
  if constexpr (kHasSpecular) {
    if (specular_.f90 > 0) {
      const vec3 out = vec3(1.0f) - schlick(specular_.f0, specular_.f90, glm::dot(flake, wo_));
      const vec3 in = vec3(1.0f) - schlick(specular_.f0, specular_.f90, cos_i);
      return out * in;
    }
  }
  return vec3(1.0f);
}

template <unsigned kChannels>
vec3 FlakeModel<kChannels>::eval(const vec3& wi, [[maybe_unused]] Rng& rng) const {
  vec3 single(0.0f);
  if constexpr (kHasSpecular) {
    if (chances_.specular > 0) {
      const float cos_h = glm::dot(half_vector(wo_, wi), wo_);
      single +=
          schlick(specular_.f0, specular_.f90, cos_h) * (Sggx(specular_.flakes).specular_phase(wo_, wi) * masking(wi));
    }
  }
  if constexpr (kHasBase) {
    if (chances_.diffuse + chances_.transmission > 0) {
      const vec3 flake = Sggx(flakes_).sample_visible(wo_, rng.next(), rng.next());
      const float c = glm::dot(flake, wi), cos_i = std::abs(c);
      single += base_albedo(c < 0) * coupling(flake, cos_i) * (cos_i * kInvPi);
    }
  }
  vec3 value = single_share() * single;
  if constexpr (kHasMultiple) {
    value += multiple_.share * multiple_.norm * Sggx(flakes_).sigma(wi) * multiple_.albedo;
  }
  return value;
}

template <unsigned kChannels>
float FlakeModel<kChannels>::pdf(const vec3& wi) const {
  float density = 0;
  if constexpr (kHasSpecular) {
    if (chances_.specular > 0) density += chances_.specular * Sggx(specular_.flakes).specular_phase(wo_, wi);
  }
  if constexpr (kHasDiffuse) {
    if (chances_.diffuse > 0) density += chances_.diffuse * diffuse_density(flakes_, wo_, wi);
  }
  if constexpr (kHasTransmission) {
    if (chances_.transmission > 0) density += chances_.transmission * diffuse_density(flakes_, wo_, -wi);
  }
  if constexpr (kHasMultiple) density += chances_.multiple * multiple_.norm * Sggx(flakes_).sigma(wi);
  return density;
}

template <unsigned kChannels>
ScatterResult FlakeModel<kChannels>::sample(Rng& rng) const {
  const Chances& p = chances_;
  float u = rng.next();
  ScatterResult result;
  if constexpr (kHasMultiple) {
    if (u < p.multiple) {
      result.wi = Sggx(flakes_).sample_sigma(rng);
      result.weight = multiple_.albedo;  // chosen with probability 1 - A, which is its share
      result.pdf = pdf(result.wi);
      return result;
    }
    u -= p.multiple;
  }
  if constexpr (kHasSpecular) {
    if (u < p.specular) {
      const vec3 flake = Sggx(specular_.flakes).sample_visible(wo_, rng.next(), rng.next());
      result.wi = reflect_about(wo_, flake);
      result.weight = schlick(specular_.f0, specular_.f90, glm::dot(flake, wo_)) *
                      (single_share() / p.specular * masking(result.wi));
      result.pdf = pdf(result.wi);
      return result;
    }
    u -= p.specular;
  }
  if (!(p.diffuse + p.transmission > 0)) return {};
  const vec3 flake = Sggx(flakes_).sample_visible(wo_, rng.next(), rng.next());
  const bool through = p.transmission > 0 && !(u < p.diffuse);
  result.wi = cosine_lobe(through ? -flake : flake, rng.next(), rng.next());
  result.weight = base_albedo(through) * coupling(flake, std::abs(glm::dot(flake, result.wi))) *
                  (single_share() / (through ? p.transmission : p.diffuse));
  result.pdf = pdf(result.wi);
  return result;
}

#define FARFIELD_FLAKE_MODELS(shadowing)      \
  template class FlakeModel<0 | (shadowing)>; \
  template class FlakeModel<1 | (shadowing)>; \
  template class FlakeModel<2 | (shadowing)>; \
  template class FlakeModel<3 | (shadowing)>; \
  template class FlakeModel<4 | (shadowing)>; \
  template class FlakeModel<5 | (shadowing)>; \
  template class FlakeModel<6 | (shadowing)>; \
  template class FlakeModel<7 | (shadowing)>;
FARFIELD_FLAKE_MODELS(0)
FARFIELD_FLAKE_MODELS(kSelfShadowing)

static_assert(sizeof(FlakePhase) <= 160);
static_assert(sizeof(FlakeModel<kDiffuse>) <= 64);

}  // namespace farfield
