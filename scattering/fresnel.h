// SPDX-License-Identifier: Apache-2.0
// Fresnel reflectance of one facet.
#pragma once

#include "base/vec.h"

namespace farfield {

/// The reflectance at grazing angles that goes with F0: 1, except that F0 below 4 % fades it out with F0, so that F0 =
/// 0 is no specular at all.
inline float grazing_reflectance(const vec3& f0) { return std::min(1.0f, 25.0f * max_component(f0)); }

/// Schlick's Fresnel [Schlick 1994], F0 + (F90 - F0) (1 - cos)^5. cos in [0, 1].
inline vec3 schlick(const vec3& f0, float f90, float cos) {
  const float x = 1.0f - std::min(cos, 1.0f);
  const float x5 = (x * x) * (x * x) * x;
  return f0 + (vec3(f90) - f0) * x5;
}

/// Unpolarised reflectance of a smooth dielectric. eta: index inside over index outside, > 0. cos in [0, 1], on the
/// outside. 1 where all light is reflected.
inline float fresnel_dielectric(float cos, float eta) {
  const float sin2_inside = (1.0f - cos * cos) / (eta * eta);
  if (sin2_inside >= 1.0f) return 1.0f;
  const float cos_inside = std::sqrt(1.0f - sin2_inside);
  const float parallel = (eta * cos - cos_inside) / (eta * cos + cos_inside);
  const float across = (cos - eta * cos_inside) / (cos + eta * cos_inside);
  return 0.5f * (parallel * parallel + across * across);
}

/// Unpolarised reflectance of a conductor with index eta + i k against the outside [Born and Wolf 1999, 14.2]. cos in
/// [0, 1].
inline float fresnel_conductor(float cos, float eta, float k) {
  const float cos2 = cos * cos, sin2 = 1.0f - cos2;
  const float t0 = eta * eta - k * k - sin2;
  const float a2_b2 = std::sqrt(t0 * t0 + 4.0f * eta * eta * k * k);
  const float a = std::sqrt(std::max(0.0f, 0.5f * (a2_b2 + t0)));
  const float across = (a2_b2 + cos2 - 2.0f * a * cos) / (a2_b2 + cos2 + 2.0f * a * cos);
  const float t3 = cos2 * a2_b2 + sin2 * sin2, t4 = 2.0f * a * cos * sin2;
  return 0.5f * across * (1.0f + (t3 - t4) / (t3 + t4));
}

}  // namespace farfield
