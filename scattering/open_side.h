// SPDX-License-Identifier: Apache-2.0
// Flakes whose two sides differ: of a leaf that is folded or curled, the side that bulges loses less light to the leaf
// itself than the hollow one, and of a crown whose leaves hang alike all bulge the same way. A flat flake does not
// know. With m the normal on the viewer's side, such a side lets
//
//   1 + open_side.m
//
// times as much of its light away, of the base and of the highlight, as the flake does on the mean of its sides
// (docs/decisions/0019, 0033). What stays meets the same leaf again: so it is the odds of albedos that are multiplied,
// and white stays white.
#pragma once

#include "base/vec.h"

namespace farfield {

/// The longest open_side: more is no leaf, but noise.
inline constexpr float kMostOpenSide = 0.5f;

/// How much more of its light a side with this unit normal lets away: what odds of albedos are multiplied by
/// (odds_gain() in scattering/albedo.h), of the base and of the highlight.
inline float side_opening(const vec3& open_side, const vec3& normal) { return 1.0f + glm::dot(open_side, normal); }

}  // namespace farfield
