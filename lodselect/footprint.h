// SPDX-License-Identifier: Apache-2.0
// Footprints and the continuous level lambda (docs/theory.md, section 11; thesis 1.3).
#pragma once

#include <cstdint>
#include <span>

#include "base/vec.h"
#include "farfield/camera.h"

namespace farfield {

/// lambda = log2(footprint / base_resolution), clamped to [0, coarsest_level]. Footprint 0 (or NaN) gives 0, infinity
/// gives the coarsest level. Monotone in the footprint.
float lambda_of_footprint(float footprint, float base_resolution, int coarsest_level);

/// The finest (smallest) footprint that any of the cameras has on a box: at the box's nearest point. World space.
float finest_footprint(std::span<const TessellationCamera> cameras, const Box3& bounds_world);

/// About how many pixels a box covers in the camera that sees most of it, as from the distance of its middle and at
/// least a quarter of its diagonal, whatever is in its way or off the screen. Infinite where pixels have no width, 0
/// for an empty box or without cameras. World space.
double covered_pixels(std::span<const TessellationCamera> cameras, const Box3& bounds_world);

/// The two levels a lambda lies between and where: level = floor(lambda), blend = lambda - level in [0, 1).
struct LevelBlend {
  int level;
  float blend;
};
LevelBlend split_lambda(float lambda);

}  // namespace farfield
