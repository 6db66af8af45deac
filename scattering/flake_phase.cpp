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

FlakePhase::FlakePhase(const FlakeParams& params, const vec3& wo) : wo_(wo) {
  const SymMat3 s = usable_sggx(params.sggx);
  flakes_ = cholesky(s);
  diffuse_ = clamp_albedo(params.diffuse);
  transmission_ = clamp_albedo(params.transmission);
  specular_ = clamp_albedo(params.specular);
  const vec3 excess = glm::max(vec3(1.0f), diffuse_ + transmission_);
  diffuse_ /= excess, transmission_ /= excess;
  multiple_ = diffuse_ + transmission_;
  self_shadowing_ = params.self_shadowing >= 0 ? std::min(params.self_shadowing, 1.0f) : 1.0f;

  chances_.diffuse = max_component(diffuse_);
  chances_.transmission = max_component(transmission_);
  f90_ = grazing_reflectance(specular_);
  if (f90_ > 0) {
    const float roughness2 = params.roughness2 < 1.0f ? std::max(params.roughness2, 0.0f) : 1.0f;
    // sigma^2 / sigma'^2 = 1 / ((1 - r) + r tr(S) / sigma^2) is largest where sigma^2 is lambda_max.
    const float largest = static_cast<float>(eigenvalues(s).x);
    const float scale = 1.0f / ((1.0f - roughness2) + roughness2 * s.trace() / largest);
    specular_flakes_ = cholesky(specular_sggx(s, roughness2) * scale);

    const vec3 mean = mean_schlick(specular_, f90_);
    const vec3 rest = glm::max(vec3(1e-6f), vec3(1.0f) - mean);
    multiple_ = mean + (vec3(1.0f) - mean) * multiple_;
    chances_.specular = max_component(mean);
    chances_.diffuse *= 1 - min_component(mean);
    chances_.transmission *= 1 - min_component(mean);
    diffuse_ /= rest, transmission_ /= rest;
  }
  if (self_shadowing_ < 1) {
    const dvec3 l = eigenvalues(s);
    multiple_norm_ = static_cast<float>(1 / (4 * kPiOf<double> * carlson_rg(l.x, l.y, l.z)));
    chances_.multiple = max_component(multiple_);
  }

  const float single = chances_.specular + chances_.diffuse + chances_.transmission;
  const float share = single > 0 ? self_shadowing_ / single : 0.0f;
  chances_.specular *= share, chances_.diffuse *= share, chances_.transmission *= share;
  chances_.multiple = chances_.multiple > 0 ? 1.0f - self_shadowing_ : 0.0f;
}

// F D'(h) g(wi) / (4 sigma'(wo)).
vec3 FlakePhase::specular_value(const vec3& wi) const {
  const BasicSggx<float> sggx(specular_flakes_);
  const vec3 h = half_vector(wo_, wi);
  return schlick(specular_, f90_, glm::dot(h, wo_)) * (sggx.specular_phase(wo_, wi) * specular_masking(wi));
}

float FlakePhase::specular_masking(const vec3& wi) const {
  return std::min(1.0f, Sggx(flakes_).sigma(wi) / Sggx(specular_flakes_).sigma(wi));
}

// What couples the diffuse base to the specular lobe, c(wo) c(wi); the albedos hold 1 / (1 - mean F) already.
vec3 FlakePhase::base_value(const vec3& flake, float cos_i) const {
  if (!(f90_ > 0)) return vec3(1.0f);
  const vec3 out = vec3(1.0f) - schlick(specular_, f90_, glm::dot(flake, wo_));
  const vec3 in = vec3(1.0f) - schlick(specular_, f90_, cos_i);
  return out * in;
}

vec3 FlakePhase::eval(const vec3& wi, Rng& rng) const {
  vec3 single(0.0f);
  if (chances_.specular > 0) single += specular_value(wi);
  if (chances_.diffuse + chances_.transmission > 0) {
    const vec3 flake = Sggx(flakes_).sample_visible(wo_, rng.next(), rng.next());
    const float c = glm::dot(flake, wi);
    const float cos_i = std::abs(c);
    single += (c > 0 ? diffuse_ : transmission_) * base_value(flake, cos_i) * (cos_i * kInvPi);
  }
  vec3 value = self_shadowing_ * single;
  if (chances_.multiple > 0) value += (1 - self_shadowing_) * multiple_norm_ * Sggx(flakes_).sigma(wi) * multiple_;
  return value;
}

float FlakePhase::pdf(const vec3& wi) const {
  float density = 0;
  if (chances_.specular > 0) density += chances_.specular * Sggx(specular_flakes_).specular_phase(wo_, wi);
  if (chances_.diffuse > 0) density += chances_.diffuse * diffuse_density(flakes_, wo_, wi);
  if (chances_.transmission > 0) density += chances_.transmission * diffuse_density(flakes_, wo_, -wi);
  if (chances_.multiple > 0) density += chances_.multiple * multiple_norm_ * Sggx(flakes_).sigma(wi);
  return density;
}

ScatterResult FlakePhase::sample(Rng& rng) const {
  const Chances& p = chances_;
  const float u = rng.next();
  ScatterResult result;
  if (u < p.specular) {
    const Sggx sggx(specular_flakes_);
    const vec3 flake = sggx.sample_visible(wo_, rng.next(), rng.next());
    result.wi = reflect_about(wo_, flake);
    result.weight =
        schlick(specular_, f90_, glm::dot(flake, wo_)) * (self_shadowing_ / p.specular * specular_masking(result.wi));
  } else if (u < p.specular + p.diffuse + p.transmission) {
    const vec3 flake = Sggx(flakes_).sample_visible(wo_, rng.next(), rng.next());
    const bool through = !(u < p.specular + p.diffuse);
    result.wi = cosine_lobe(through ? -flake : flake, rng.next(), rng.next());
    const float share = self_shadowing_ / (through ? p.transmission : p.diffuse);
    const float cos_i = std::abs(glm::dot(flake, result.wi));
    result.weight = (through ? transmission_ : diffuse_) * base_value(flake, cos_i) * share;
  } else if (p.multiple > 0) {
    result.wi = Sggx(flakes_).sample_sigma(rng);
    result.weight = multiple_ * ((1 - self_shadowing_) / p.multiple);
  } else {
    return {};
  }
  result.pdf = pdf(result.wi);
  return result;
}

static_assert(sizeof(FlakePhase) <= 160);

}  // namespace farfield
