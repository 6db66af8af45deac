// SPDX-License-Identifier: Apache-2.0
#include "lodselect/footprint.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfield {

namespace {

/// x or 0; NaN stays NaN, so that it does not look like "inside the box".
double positive_part(double x) { return x <= 0 ? 0.0 : x; }

/// Distance from a point to the nearest point of a box; 0 inside. In double: squares of large floats overflow a float.
double distance_to(const Box3& box, const vec3& point) {
  double squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double below = positive_part(static_cast<double>(box.lower[axis]) - point[axis]);
    const double above = positive_part(static_cast<double>(point[axis]) - box.upper[axis]);
    squared += below * below + above * above;
  }
  return std::sqrt(squared);
}

/// Whether no point of a box is in the camera's frustum, as far as single planes tell.
bool is_off_screen(const TessellationCamera& camera, const Box3& box) {
  for (int i = 0; i < camera.frustum_planes; ++i) {
    const glm::vec4& plane = camera.frustum[i];
    double furthest_inside = plane.w;
    for (int axis = 0; axis < 3; ++axis) {
      const float corner = plane[axis] > 0.0f ? box.upper[axis] : box.lower[axis];
      furthest_inside += static_cast<double>(plane[axis]) * static_cast<double>(corner);
    }
    if (furthest_inside < 0) return true;
  }
  return false;
}

}  // namespace

float lambda_of_footprint(float footprint, float base_resolution, int coarsest_level) {
  if (!(footprint > base_resolution)) return 0.0f;  // also for NaN of either
  const float lambda = std::log2(footprint / base_resolution);
  return std::clamp(lambda, 0.0f, static_cast<float>(std::max(coarsest_level, 0)));
}

float finest_footprint(std::span<const TessellationCamera> cameras, const Box3& bounds_world) {
  float finest = std::numeric_limits<float>::infinity();
  if (bounds_world.is_empty()) return finest;
  for (const TessellationCamera& camera : cameras) {
    double footprint = camera.pixel_width + camera.pixel_spread * distance_to(bounds_world, camera.position);
    if (camera.off_screen_scale > 1.0f && is_off_screen(camera, bounds_world)) footprint *= camera.off_screen_scale;
    if (std::isnan(footprint)) return 0.0f;
    finest = std::min(finest, static_cast<float>(footprint));
  }
  return finest;
}

double covered_pixels(std::span<const TessellationCamera> cameras, const Box3& bounds_world) {
  if (bounds_world.is_empty()) return 0;
  const dvec3 size = dvec3(bounds_world.upper) - dvec3(bounds_world.lower);
  const dvec3 middle = 0.5 * (dvec3(bounds_world.lower) + dvec3(bounds_world.upper));
  const dvec3 side_area(size.y * size.z, size.z * size.x, size.x * size.y);
  double most = 0;
  for (const TessellationCamera& camera : cameras) {
    const dvec3 view = middle - dvec3(camera.position);
    const double distance = std::max(glm::length(view), 0.25 * glm::length(size));
    const bool has_direction = camera.pixel_spread > 0 && glm::length(view) > 0;
    const dvec3 cosines = has_direction ? glm::abs(glm::normalize(view)) : dvec3(1.0);  // all three: not too few
    const double pixel = camera.pixel_width + camera.pixel_spread * distance;
    const double pixels = pixel > 0 ? glm::dot(cosines, side_area) / (pixel * pixel) : INFINITY;
    most = std::max(most, pixels);
  }
  return most;
}

LevelBlend split_lambda(float lambda) {
  constexpr float kFarBeyondAnyLevel = 1e6f;
  if (!(lambda > 0.0f)) return {0, 0.0f};
  lambda = std::min(lambda, kFarBeyondAnyLevel);
  const float level = std::floor(lambda);
  return {static_cast<int>(level), lambda - level};  // exact, so below 1
}

}  // namespace farfield
