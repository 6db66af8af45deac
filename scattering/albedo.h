// SPDX-License-Identifier: Apache-2.0
// Albedos, linear RGB: into their range, and of clusters.
#pragma once

#include <cmath>

#include "base/vec.h"

namespace farfield {

/// Into [0, 1]; NaN becomes 0.
inline vec3 clamp_albedo(const vec3& albedo) {
  // fmax turns NaN into 0.
  return glm::min(vec3(std::fmax(0.0f, albedo.x), std::fmax(0.0f, albedo.y), std::fmax(0.0f, albedo.z)), vec3(1.0f));
}

/// Scales both down where their sum is above 1.
inline void limit_sum(vec3& reflected, vec3& transmitted) {
  const vec3 excess = glm::max(vec3(1.0f), reflected + transmitted);
  reflected /= excess;
  transmitted /= excess;
}

/// What comes back of light that meets a highlight over a base; linear RGB in [0, 1] if all are and the base's sum is.
inline vec3 layered_albedo(const vec3& specular, const vec3& base) { return specular + (vec3(1.0f) - specular) * base; }

/// What an albedo in [0, 1] is multiplied by when the odds albedo / (1 - albedo) are by share > 0: 1 for white, about
/// share for dark ones.
inline vec3 odds_gain(const vec3& albedo, float share) { return share / (vec3(1.0f) - albedo + share * albedo); }

/// The albedo of a cluster of scatterers of this albedo, when a share of what each scatters leaves the cluster and the
/// rest meets another of them: the sum of share albedo ((1 - share) albedo)^n over n >= 0. albedo in [0, 1], share > 0.
/// The result is 1 for white scatterers, about share * albedo for dark ones, and never above 1: the odds albedo / (1 -
/// albedo) are multiplied by share. So 1 / share is the inverse, and a share above 1 gives scatterers so bright that
/// their cluster, with 1 / share, has this albedo.
inline vec3 cluster_albedo(const vec3& albedo, float share) { return albedo * odds_gain(albedo, share); }

}  // namespace farfield
