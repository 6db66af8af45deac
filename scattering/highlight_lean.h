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

namespace farfield {

/// The most that a highlight leans, to the viewer's side or (negative) away from it.
inline constexpr float kMostHighlightLean = 0.7f;

/// How much more of the highlight gets away at this phase angle: what odds of albedos are multiplied by (odds_gain() in
/// scattering/albedo.h).
inline float highlight_leaning(float lean, float phase_cosine) { return 1.0f + lean * phase_cosine; }

}  // namespace farfield
