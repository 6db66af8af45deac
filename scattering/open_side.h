// SPDX-License-Identifier: Apache-2.0
// Flakes whose two sides differ: of a leaf that is folded or curled, the side that bulges loses less light to the leaf
// itself than the hollow one, and of a crown whose leaves hang alike all bulge the same way. A flat flake does not
// know. With m the normal on the viewer's side, such a side lets
//
//   1 + open_side.m
//
// times as much of its light away as the flake does on the mean of its sides (docs/decisions/0019). What stays meets
// the same leaf again: so it is the odds of its albedo that are multiplied, and white stays white.
#pragma once

#include "base/vec.h"
#include "scattering/albedo.h"

namespace farfield {

/// The longest open_side: more is no leaf, but noise.
inline constexpr float kMostOpenSide = 0.5f;

/// What the diffuse reflectance and transmission of a side (their sum `base`, in [0, 1]) are multiplied by.
inline vec3 open_side_gain(const vec3& open_side, const vec3& normal, const vec3& base) {
  return odds_gain(base, 1.0f + glm::dot(open_side, normal));
}

}  // namespace farfield
