// SPDX-License-Identifier: Apache-2.0
// Coefficients: [Preetham et al. 1999], appendix A.2 (sky) and A.1 (sun).
#include "path_tracer/preetham_sky.h"

#include <algorithm>

namespace farfield {

namespace {

// CIE xyY to linear RGB, Rec. 709 primaries and D65; colours outside the gamut are clipped.
vec3 rgb_of_xyY(float x, float y, float Y) {
  const float X = x / y * Y, Z = (1 - x - y) / y * Y;
  return glm::max(
      vec3(3.2404542f * X - 1.5371385f * Y - 0.4985314f * Z, -0.9692660f * X + 1.8760108f * Y + 0.0415560f * Z,
           0.0556434f * X - 0.2040259f * Y + 1.0572252f * Z),
      vec3(0.0f));
}

// c0 t^3 + c1 t^2 + c2 t + c3
float cubic(float t, float c0, float c1, float c2, float c3) { return ((c0 * t + c1) * t + c2) * t + c3; }

float zenith_luminance(float T, float theta_sun) {
  const float chi = (4.0f / 9.0f - T / 120.0f) * (kPi - 2 * theta_sun);
  return (4.0453f * T - 4.9710f) * std::tan(chi) - 0.2155f * T + 2.4192f;
}

float zenith_x(float T, float t) {
  return T * T * cubic(t, 0.00166f, -0.00375f, 0.00209f, 0.0f) +
         T * cubic(t, -0.02903f, 0.06377f, -0.03202f, 0.00394f) + cubic(t, 0.11693f, -0.21196f, 0.06052f, 0.25886f);
}

float zenith_y(float T, float t) {
  return T * T * cubic(t, 0.00275f, -0.00610f, 0.00317f, 0.0f) +
         T * cubic(t, -0.04214f, 0.08970f, -0.04153f, 0.00516f) + cubic(t, 0.15346f, -0.26756f, 0.06670f, 0.26688f);
}

// Sunlight through the air, at one wavelength per channel (the dominant ones of the Rec. 709 primaries). Ozone, mixed
// gases and water vapour are left out: together below 3 % there.
vec3 sun_through_air(float T, float theta_sun) {
  constexpr float kSunKlx = 128.0f;                    // above the atmosphere
  constexpr vec3 kSunColor(1.05f, 1.0f, 0.98f);        // relative to D65, luminance near 1
  constexpr vec3 kWavelength(0.612f, 0.549f, 0.465f);  // micrometres
  const float degrees = theta_sun * 180 / kPi;
  const float air_mass = 1 / (std::cos(theta_sun) + 0.15f * std::pow(93.885f - degrees, -1.253f));
  const float beta = 0.04608f * T - 0.04586f;  // aerosol
  vec3 irradiance;
  for (int c = 0; c < 3; ++c) {
    const float rayleigh = 0.008735f * std::pow(kWavelength[c], -4.08f);
    const float aerosol = beta * std::pow(kWavelength[c], -1.3f);
    irradiance[c] = kSunKlx * kSunColor[c] * std::exp(-(rayleigh + aerosol) * air_mass);
  }
  return irradiance;
}

}  // namespace

float PreethamSky::Perez::operator()(float cos_theta, float gamma, float cos_gamma) const {
  return (1 + a * std::exp(b / cos_theta)) * (1 + c * std::exp(d * gamma) + e * cos_gamma * cos_gamma);
}

PreethamSky::PreethamSky(const vec3& sun_direction, float T)
    : sun_direction_(sun_direction),
      perez_Y_{0.1787f * T - 1.4630f, -0.3554f * T + 0.4275f, -0.0227f * T + 5.3251f, 0.1206f * T - 2.5771f,
               -0.0670f * T + 0.3703f},
      perez_x_{-0.0193f * T - 0.2592f, -0.0665f * T + 0.0008f, -0.0004f * T + 0.2125f, -0.0641f * T - 0.8989f,
               -0.0033f * T + 0.0452f},
      perez_y_{-0.0167f * T - 0.2608f, -0.0950f * T + 0.0092f, -0.0079f * T + 0.2102f, -0.0441f * T - 1.6537f,
               -0.0109f * T + 0.0529f} {
  const float cos_sun = std::clamp(sun_direction.y, 0.0f, 1.0f);
  const float theta_sun = std::acos(cos_sun);
  scale_Y_ = zenith_luminance(T, theta_sun) / perez_Y_(1.0f, theta_sun, cos_sun);
  scale_x_ = zenith_x(T, theta_sun) / perez_x_(1.0f, theta_sun, cos_sun);
  scale_y_ = zenith_y(T, theta_sun) / perez_y_(1.0f, theta_sun, cos_sun);
  sun_irradiance_ = sun_through_air(T, theta_sun);
}

vec3 PreethamSky::radiance(const vec3& direction) const {
  const float cos_theta = std::max(direction.y, 1e-3f);  // at the horizon itself the model divides by 0
  const float cos_gamma = std::clamp(glm::dot(direction, sun_direction_), -1.0f, 1.0f);
  const float gamma = std::acos(cos_gamma);
  const float Y = std::max(scale_Y_ * perez_Y_(cos_theta, gamma, cos_gamma), 0.0f);
  return rgb_of_xyY(scale_x_ * perez_x_(cos_theta, gamma, cos_gamma), scale_y_ * perez_y_(cos_theta, gamma, cos_gamma),
                    Y);
}

}  // namespace farfield
