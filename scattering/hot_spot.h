// SPDX-License-Identifier: Apache-2.0
// The hot spot of foliage: light that arrives from where the viewer is has a way free of leaves, since the viewer's own
// way is free; light from the other side meets the clump that the viewer sees the front of. A medium does not know.
// With the phase angle between wo and wi, and m the scatterer's normal, what a Lambertian surface reflects is
// multiplied by
//
//   1 + strength (L(wo.wi) - mean of L over the lobe)
//
// with L(c) = -ln((1 - c + e) / (2 + e)) / 2, about -ln sin(angle / 2).
// As much light leaves in all, for each flake. What goes through a leaf was measured to know nothing of that angle
// (docs/decisions/0024), and highlights have their own way (scattering/highlight_lean.h). L is what trees show
// (docs/decisions/0017); leaf optics has other forms, with one or two more parameters [Kuusk 1985].
#pragma once

#include <algorithm>
#include <cmath>

namespace farfield {

/// With more, the factor could be negative.
inline constexpr float kStrongestHotSpot = 0.7f;

/// L; cosine in [-1, 1]. From 0, opposite to the viewer, to 3.1. Flat within about 5 degrees of the viewer.
inline float hot_spot_lobe(float phase_cosine) {
  constexpr float kFlat = 0.004f;
  return -0.5f * std::log((1.0f - std::min(phase_cosine, 1.0f) + kFlat) * (1.0f / (2.0f + kFlat)));
}

/// The mean of L over a cosine lobe around a normal with this cosine to wo, in [-1, 1]; a fit, within 0.001.
inline float mean_hot_spot_lobe(float normal_cosine) {
  const float x = normal_cosine;
  return 0.441342f + x * (0.489546f + x * (0.178190f - 0.0346324f * x * x));
}

/// The factor. normal_cosine: of the lobe's side; strength in [0, kStrongestHotSpot]; 0: 1.
inline float hot_spot(float strength, float phase_cosine, float normal_cosine) {
  return 1.0f + strength * (hot_spot_lobe(phase_cosine) - mean_hot_spot_lobe(normal_cosine));
}

}  // namespace farfield
