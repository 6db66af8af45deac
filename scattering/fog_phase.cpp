// SPDX-License-Identifier: Apache-2.0
#include "scattering/fog_phase.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scattering/albedo.h"
#include "scattering/carlson.h"
#include "scattering/warp.h"

namespace farfield {
namespace {

constexpr float kUniform = 0.25f * kInvPi;    ///< density on the whole sphere
constexpr float kLeastSelfShadowing = 1e-4f;  ///< smaller A is taken as this one: white must not divide 0 by 0
constexpr float kNoAnisotropy = 1e-3f;        ///< below it the inversion of the cosine loses its digits

/// The cosine between the ways before and after; u uniform in [0, 1).
float sample_cosine(float g, float u) {
  const float square = (1 - g * g) / (1 - g + 2 * g * u);
  return std::clamp((1 + g * g - square * square) / (2 * g), -1.0f, 1.0f);
}

}  // namespace

float henyey_greenstein(float cosine, float g) {
  const float d = std::max(1 + g * g - 2 * g * cosine, (1 - std::abs(g)) * (1 - std::abs(g)));
  return kUniform * (1 - g * g) / (d * std::sqrt(d));
}

FogPhase::FogPhase(const FogParams& params, const vec3& wo)
    : wo_(wo), single_(clamp_albedo(params.albedo)), multiple_(single_), g_(params.anisotropy) {
  if (params.self_shadowing < 1) {
    share_ = std::max(params.self_shadowing, kLeastSelfShadowing);
    multiple_ = single_ * cluster_albedo(single_, share_);
  }
  if (std::abs(g_) < kNoAnisotropy) g_ = 0;
  const float trace = params.sggx.trace();
  if (!params.has_shape || !(trace > std::numeric_limits<float>::min()) || !std::isfinite(trace)) return;
  const SymMat3 s = params.sggx * (1.0f / trace);
  shape_ = cholesky(s);
  const vec3 eigen(eigenvalues(s));
  shape_norm_ = kUniform / carlson_rg(eigen.x, eigen.y, eigen.z);
}

float FogPhase::shape_density(const vec3& wi) const {
  return shape_norm_ > 0 ? shape_norm_ * Sggx(shape_).sigma(wi) : kUniform;
}

FogPhase::Split FogPhase::densities(const vec3& wi) const {
  const float single = g_ != 0 ? henyey_greenstein(-glm::dot(wo_, wi), g_) : shape_density(wi);
  if (share_ >= 1) return {single, 0.0f};
  return {share_ * single, (1 - share_) * (g_ != 0 ? shape_density(wi) : single)};
}

vec3 FogPhase::eval(const vec3& wi, Rng&) const {
  const Split split = densities(wi);
  return split.single * single_ + split.multiple * multiple_;
}

float FogPhase::pdf(const vec3& wi) const {
  const Split split = densities(wi);
  return split.single + split.multiple;
}

ScatterSample FogPhase::sample(Rng& rng) const {
  ScatterSample sample;
  if (g_ != 0 && (share_ >= 1 || rng.next() < share_)) {
    const float cosine = sample_cosine(g_, rng.next());
    sample.wi = Frame(-wo_).to_world(direction_at_height(cosine, rng.next()));
  } else if (shape_norm_ > 0) {
    sample.wi = Sggx(shape_).sample_sigma(rng);
  } else {
    const float u1 = rng.next(), u2 = rng.next();
    sample.wi = uniform_sphere(u1, u2);
  }
  const Split split = densities(sample.wi);
  sample.pdf = split.single + split.multiple;
  if (!(sample.pdf > 0)) return {};
  sample.weight = (split.single * single_ + split.multiple * multiple_) / sample.pdf;
  return sample;
}

}  // namespace farfield
