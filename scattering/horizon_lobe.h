// SPDX-License-Identifier: Apache-2.0
// What a diffuse lobe around a shading normal loses below the horizon of the surface itself, given back.
#pragma once

#include "base/vec.h"
#include "scattering/albedo.h"
#include "scattering/convention.h"
#include "scattering/surface_bsdf.h"
#include "scattering/warp.h"

namespace farfield {

/// Of a cosine lobe around m, (1 - m.n) / 2 lies below the plane of n: a half disc seen from the side. That share comes
/// back as a cosine lobe around n, so that white stays white, whatever the two normals are (as with all shading
/// normals, light and eye are not exchangeable). Immutable; any thread.
struct HorizonLobe {
  vec3 n{0.0f};            ///< unit, geometric
  vec3 reflected{0.0f};    ///< albedo of the lobe, linear RGB
  vec3 transmitted{0.0f};  ///< of that on the other side
  float chance = 0;        ///< how often one should sample this lobe; 0: the normals agree

  HorizonLobe() = default;
  /// m: unit shading normal, m.n >= 0.
  HorizonLobe(const SurfaceParams& params, const vec3& m, const vec3& geometric_normal) : n(geometric_normal) {
    const float lost = 0.5f * (1 - glm::dot(m, n));
    if (!(lost > kLeastLoss)) return;
    reflected = clamp_albedo(params.diffuse), transmitted = clamp_albedo(params.transmission);
    limit_sum(reflected, transmitted);
    if (!(max_component(reflected + transmitted) > 0)) return;
    const vec3 left = lost * (1.0f - clamp_albedo(params.specular));
    reflected *= left, transmitted *= left;
    chance = lost;
  }

  /// f |cos|.
  vec3 eval(const vec3& wi) const {
    const float cosine = glm::dot(n, wi);
    return (cosine > 0 ? reflected : transmitted) * (std::abs(cosine) * kInvPi);
  }
  /// Of sample(), per steradian.
  float pdf(const vec3& wi) const {
    const float cosine = glm::dot(n, wi);
    return (cosine > 0 ? share_reflected() : 1 - share_reflected()) * std::abs(cosine) * kInvPi;
  }
  vec3 sample(float side, float u1, float u2) const { return cosine_lobe(side < share_reflected() ? n : -n, u1, u2); }

 private:
  static constexpr float kLeastLoss = 1e-4f;

  float share_reflected() const {
    const float up = max_component(reflected), down = max_component(transmitted);
    return up / (up + down);
  }
};

}  // namespace farfield
