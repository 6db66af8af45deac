// SPDX-License-Identifier: Apache-2.0
// The analytic clear sky of [Preetham et al. 1999].
#pragma once

#include "base/vec.h"

namespace farfield {

/// Immutable. Directions are unit; up is +y.
class PreethamSky {
 public:
  /// sun_direction: unit, y >= 0. turbidity: in [1.7, 10].
  PreethamSky(const vec3& sun_direction, float turbidity);

  /// Linear RGB whose luminance is in kcd / m^2, for directions with y >= 0 (others are taken at the horizon).
  vec3 radiance(const vec3& direction) const;
  /// Linear RGB irradiance of the sun on a surface that faces it; its luminance is in klx.
  vec3 sun_irradiance() const { return sun_irradiance_; }

 private:
  // F(theta, gamma) = (1 + a exp(b / cos theta)) (1 + c exp(d gamma) + e cos^2 gamma) [Perez et al. 1993]
  struct Perez {
    float a, b, c, d, e;
    float operator()(float cos_theta, float gamma, float cos_gamma) const;
  };

  vec3 sun_direction_;
  Perez perez_Y_, perez_x_, perez_y_;
  float scale_Y_, scale_x_, scale_y_;  // zenith value / F(0, theta_sun)
  vec3 sun_irradiance_;
};

}  // namespace farfield
