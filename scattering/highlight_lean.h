// SPDX-License-Identifier: Apache-2.0
// The highlight of foliage seen against the light: it is made by leaves that are seen edge-on, and of those fewer are
// free to the viewer and to the light at once than a medium makes believe; of other things more
// (docs/decisions/0024). Of a flake's highlight
//
//   1 + lean wo.wi
//
// times as much gets away. What stays meets the same flake again: so it is the odds of its albedo that are multiplied,
// and white stays white. Reciprocal as far as that albedo is the same from both sides.
#pragma once

#include "base/vec.h"
#include "scattering/albedo.h"

namespace farfield {

/// The most that a highlight leans, to the viewer's side or (negative) away from it.
inline constexpr float kMostHighlightLean = 0.7f;

/// What the highlight is multiplied by. albedo: of the flake as a whole, in [0, 1].
inline vec3 highlight_lean_gain(float lean, float phase_cosine, const vec3& albedo) {
  return odds_gain(albedo, 1.0f + lean * phase_cosine);
}

}  // namespace farfield
