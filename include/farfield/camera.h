// SPDX-License-Identifier: Apache-2.0
// Cameras, reduced to what fixes levels.
#pragma once

#include <glm/glm.hpp>

namespace farfield {

/// A camera that fixes each instance's level: at distance d a pixel is pixel_width + pixel_spread * d world units wide.
/// Perspective: width 0 and spread 2 tan(fov_y / 2) / image height in pixels. Orthographic: the pixel's width and
/// spread 0.
struct TessellationCamera {
  glm::vec3 position{0.0f};
  float pixel_width = 0;
  float pixel_spread = 0;
};

}  // namespace farfield
