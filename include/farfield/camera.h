// SPDX-License-Identifier: Apache-2.0
// Cameras, reduced to what fixes levels.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <initializer_list>

namespace farfield {

/// A camera that fixes each instance's level: at distance d a pixel is pixel_width + pixel_spread * d world units wide.
/// Perspective: width 0 and spread 2 tan(fov_y / 2) / image height in pixels. Orthographic: the pixel's width and
/// spread 0.
struct TessellationCamera {
  glm::vec3 position{0.0f};
  float pixel_width = 0;
  float pixel_spread = 0;
  /// What lies outside of the frustum is asked for as if pixels were so much wider there, >= 1: it is met by rays that
  /// other things send on, which blur it. 1: as inside.
  float off_screen_scale = 1;
  /// Points p with dot(frustum[i].xyz, p) + frustum[i].w >= 0 for all i < frustum_planes are inside; none: all are.
  glm::vec4 frustum[5] = {};
  int frustum_planes = 0;

  /// With its frustum. forward, up: not parallel, need not be unit. fov_y_rad in (0, pi); sizes in pixels, > 0.
  static TessellationCamera perspective(const glm::vec3& position, const glm::vec3& forward, const glm::vec3& up,
                                        float fov_y_rad, int width_px, int height_px) {
    const float tan_y = std::tan(0.5f * fov_y_rad);
    const float tan_x = tan_y * static_cast<float>(width_px) / static_cast<float>(height_px);
    TessellationCamera camera;
    camera.position = position;
    camera.pixel_spread = 2.0f * tan_y / static_cast<float>(height_px);
    const Axes axes(forward, up);
    camera.add_plane(axes.forward, 0.0f);
    for (const float side : {-1.0f, 1.0f}) {
      camera.add_plane(tan_x * axes.forward + side * axes.right, 0.0f);
      camera.add_plane(tan_y * axes.forward + side * axes.up, 0.0f);
    }
    return camera;
  }
  /// The same; position: any point of the plane that rays start on, at the image's centre; width_world: of the image.
  static TessellationCamera orthographic(const glm::vec3& position, const glm::vec3& forward, const glm::vec3& up,
                                         float width_world, int width_px, int height_px) {
    TessellationCamera camera;
    camera.position = position;
    camera.pixel_width = width_world / static_cast<float>(width_px);
    const float height_world = camera.pixel_width * static_cast<float>(height_px);
    const Axes axes(forward, up);
    camera.add_plane(axes.forward, 0.0f);
    for (const float side : {-1.0f, 1.0f}) {
      camera.add_plane(side * axes.right, 0.5f * width_world);
      camera.add_plane(side * axes.up, 0.5f * height_world);
    }
    return camera;
  }

  friend bool operator==(const TessellationCamera& a, const TessellationCamera& b) {
    if (a.position != b.position || a.pixel_width != b.pixel_width || a.pixel_spread != b.pixel_spread ||
        a.off_screen_scale != b.off_screen_scale || a.frustum_planes != b.frustum_planes)
      return false;
    for (int i = 0; i < a.frustum_planes; ++i) {
      if (a.frustum[i] != b.frustum[i]) return false;
    }
    return true;
  }

 private:
  struct Axes {
    glm::vec3 forward, right, up;
    Axes(const glm::vec3& along, const glm::vec3& upwards)
        : forward(glm::normalize(along)),
          right(glm::normalize(glm::cross(forward, upwards))),
          up(glm::cross(right, forward)) {}
  };
  /// inwards: of any length; distance: of the plane from the position, outwards, in units of that length.
  void add_plane(const glm::vec3& inwards, float distance) {
    frustum[frustum_planes++] = glm::vec4(inwards, distance - glm::dot(inwards, position));
  }
};

/// Between which levels k an instance is shown, whatever footprints ask; both included. The same twice: that level,
/// always. The budget goes before: it may make levels coarser than this. Rays that leave a hit keep its level.
struct LevelLimits {
  uint8_t finest = 0;
  uint8_t coarsest = 255;
};

}  // namespace farfield
