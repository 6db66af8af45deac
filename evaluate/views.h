// SPDX-License-Identifier: Apache-2.0
// The cameras of an evaluation: orthographic, around the asset, with pixels of exactly one voxel of the level
// (docs/error_metric.md). Pure; any thread.
#pragma once

#include <vector>

#include "base/vec.h"

namespace farfield {

/// An orthographic picture. Rows go down along -up, columns along right().
struct OrthoView {
  vec3 direction{0.0f, 0.0f, -1.0f};  ///< unit, the way the camera looks
  vec3 up{0.0f, 1.0f, 0.0f};          ///< unit, perpendicular to direction
  vec3 center{0.0f};                  ///< the point in the middle of the picture, in the middle of the bounds
  float pixel_size = 0;               ///< side of a pixel, scene units
  int width_px = 0, height_px = 0;

  vec3 right() const { return glm::cross(direction, up); }
  float width() const { return pixel_size * static_cast<float>(width_px); }  ///< orthographic width, scene units
};

/// `count` directions (unit, the way the camera looks) spread over the sphere. Up to 12: vertices of an icosahedron
/// around the origin, its six axes from one side, then from the other; each as far as possible from those before it, so
/// that a prefix is spread too. More: a Fibonacci lattice. Count <= 0: none.
std::vector<vec3> view_directions(int count);

/// The picture of `bounds` along `direction` with pixels of `pixel_size` (> 0): the smallest one of whole pixels that
/// contains the projected bounds and a border of one pixel, so that everything that a level adds to its source's
/// outline is seen too. Up is +y as seen from there (+x when looking along y). Empty bounds give 2 x 2 pixels at the
/// origin.
OrthoView frame_view(const Box3& bounds, const vec3& direction, float pixel_size);

}  // namespace farfield
