// SPDX-License-Identifier: Apache-2.0
// Pinhole and orthographic cameras: rays, their cones, and what the runtime needs to know of them.
#pragma once

#include <span>

#include "base/vec.h"
#include "farfield/runtime.h"

namespace farfield {

/// A camera ray and its cone: at distance t along the unit direction a pixel is cone_width + cone_spread * t wide.
struct CameraRay {
  vec3 origin{0.0f};
  vec3 direction{0.0f};
  float cone_width = 0;
  float cone_spread = 0;
};

/// A camera in world space with its image size. A plain value. Image coordinates are pixels: x to the right, y down,
/// (0, 0) the upper left corner of the image and pixel (i, j) the square [i, i+1) x [j, j+1).
class Camera {
 public:
  /// forward, up: not parallel, need not be unit. fov_y_rad: angle between the image's upper and lower edge, in
  /// (0, pi). width, height: pixels, > 0.
  static Camera perspective(const vec3& position, const vec3& forward, const vec3& up, float fov_y_rad, int width,
                            int height);
  /// position: any point of the plane that rays start on; it is seen at the image's centre. width_world: width of the
  /// image in world units; pixels are square.
  static Camera orthographic(const vec3& position, const vec3& forward, const vec3& up, float width_world, int width,
                             int height);

  int width() const { return width_; }
  int height() const { return height_; }
  const vec3& position() const { return position_; }
  const vec3& forward() const { return forward_; }
  const vec3& up() const { return up_; }
  bool is_orthographic() const { return orthographic_; }

  /// The ray through a point of the image.
  CameraRay ray(float x_px, float y_px) const;
  /// What fixes the levels that this camera sees.
  TessellationCamera tessellation() const;

 private:
  Camera(const vec3& position, const vec3& forward, const vec3& up, int width, int height);

  bool orthographic_ = false;
  int width_ = 0, height_ = 0;
  float pixel_size_ = 0;  ///< of a pixel at distance 1 (perspective) or anywhere (orthographic), world units
  vec3 position_{0.0f};
  vec3 right_{0.0f}, up_{0.0f}, forward_{0.0f};  ///< orthonormal
};

/// What a camera that moves sees at a time of its open shutter in [0, 1]: between the cameras of evenly spaced times
/// (one: it stands still; of the same kind and size), each ray goes linearly from one to the next.
CameraRay ray_at(std::span<const Camera> keys, float x_px, float y_px, float time);

}  // namespace farfield
