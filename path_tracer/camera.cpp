// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/camera.h"

#include "base/check.h"
#include "base/key_place.h"

namespace farfield {

Camera Camera::perspective(const vec3& position, const vec3& forward, const vec3& up, float fov_y_rad, int width,
                           int height) {
  FARFIELD_CHECK(fov_y_rad > 0 && fov_y_rad < kPi);
  Camera camera(position, forward, up, width, height);
  camera.pixel_size_ = 2.0f * std::tan(0.5f * fov_y_rad) / static_cast<float>(height);
  return camera;
}

Camera Camera::orthographic(const vec3& position, const vec3& forward, const vec3& up, float width_world, int width,
                            int height) {
  FARFIELD_CHECK(width_world > 0);
  Camera camera(position, forward, up, width, height);
  camera.orthographic_ = true;
  camera.pixel_size_ = width_world / static_cast<float>(width);
  return camera;
}

Camera::Camera(const vec3& position, const vec3& forward, const vec3& up, int width, int height)
    : width_(width), height_(height), position_(position), forward_(glm::normalize(forward)) {
  FARFIELD_CHECK(width > 0 && height > 0);
  right_ = glm::normalize(glm::cross(forward_, up));
  up_ = glm::cross(right_, forward_);
  FARFIELD_CHECK(is_finite(right_) && is_finite(up_));
}

CameraRay Camera::ray(float x_px, float y_px) const {
  const float x = (x_px - 0.5f * static_cast<float>(width_)) * pixel_size_;
  const float y = (0.5f * static_cast<float>(height_) - y_px) * pixel_size_;
  if (orthographic_) return {position_ + x * right_ + y * up_, forward_, pixel_size_, 0.0f};

  const vec3 to_plane = forward_ + x * right_ + y * up_;  // on the image plane, at distance 1 along forward_
  const float inv_length = 1.0f / glm::length(to_plane);
  // At ray distance t the plane through that point is t * inv_length away, and pixels have its size there.
  return {position_, to_plane * inv_length, 0.0f, pixel_size_ * inv_length};
}

CameraRay ray_at(std::span<const Camera> keys, float x_px, float y_px, float time) {
  if (keys.size() == 1) return keys.front().ray(x_px, y_px);
  const auto [key, place] = find_key_place(keys.size(), time);
  const auto t = static_cast<float>(place);
  const CameraRay a = keys[key].ray(x_px, y_px), b = keys[key + 1].ray(x_px, y_px);
  return {glm::mix(a.origin, b.origin, t), glm::normalize(glm::mix(a.direction, b.direction, t)),
          glm::mix(a.cone_width, b.cone_width, t), glm::mix(a.cone_spread, b.cone_spread, t)};
}

TessellationCamera Camera::tessellation() const {
  const float width_world = pixel_size_ * static_cast<float>(width_),
              tan_y = 0.5f * pixel_size_ * static_cast<float>(height_);
  TessellationCamera camera =
      orthographic_
          ? TessellationCamera::orthographic(position_, forward_, up_, width_world, width_, height_)
          : TessellationCamera::perspective(position_, forward_, up_, 2.0f * std::atan(tan_y), width_, height_);
  (orthographic_ ? camera.pixel_width : camera.pixel_spread) = pixel_size_;  // without the rounding of a round trip
  return camera;
}

}  // namespace farfield
