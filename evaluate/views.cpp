// SPDX-License-Identifier: Apache-2.0
#include "evaluate/views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/gtc/quaternion.hpp>
#include <span>
#include <utility>

namespace farfield {
namespace {

/// Vertices of the regular icosahedron, unit, turned so that none is within 6 degrees of a coordinate plane nor within
/// 4 of one through an axis and halfway between the others: what people build stands along axes, and in those planes
/// its parts hide behind one another or are seen edge-on, which no other view sees (docs/decisions/0040).
std::array<vec3, 12> icosahedron_vertices() {
  const auto turn = glm::mat3_cast(glm::normalize(glm::quat(-0.65f, -0.12f, -0.75f, 0.10f)));
  const float golden = 0.5f * (1.0f + std::sqrt(5.0f));
  std::array<vec3, 12> vertices;
  size_t next = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const float a : {1.0f, -1.0f})
      for (const float b : {golden, -golden}) {
        vec3 v(0.0f);
        v[(axis + 1) % 3] = a;
        v[(axis + 2) % 3] = b;
        vertices[next++] = turn * glm::normalize(v);
      }
  return vertices;
}

/// How near a vertex is to the nearest of others: its axis, then itself. In quarters, rounded: cosines between vertices
/// are 1 or 1 / sqrt(5), or the negative.
std::pair<long, long> nearness(const vec3& vertex, std::span<const vec3> others) {
  std::pair<long, long> nearest{-4, -4};
  for (const vec3& other : others) {
    const float cosine = glm::dot(vertex, other);
    nearest.first = std::max(nearest.first, std::lround(4.0f * std::abs(cosine)));
    nearest.second = std::max(nearest.second, std::lround(4.0f * cosine));
  }
  return nearest;
}

/// Reorders so that each direction is the one farthest from all before it (ties: the first), axes first: opposite views
/// have the same outline, so they tell nothing of coverage. Means of even functions over the six axes are exact up to
/// the fifth degree.
void order_farthest_first(std::array<vec3, 12>& directions) {
  for (size_t chosen = 1; chosen < directions.size(); ++chosen) {
    const auto is_farther = [&](const vec3& a, const vec3& b) {
      const std::span before(directions.data(), chosen);
      return nearness(a, before) < nearness(b, before);
    };
    const auto first = directions.begin() + static_cast<std::ptrdiff_t>(chosen);
    std::iter_swap(first, std::min_element(first, directions.end(), is_farther));
  }
}

vec3 fibonacci_direction(int i, int count) {
  const float golden_angle = kPi * (3.0f - std::sqrt(5.0f));
  const float y = 1.0f - (2.0f * static_cast<float>(i) + 1.0f) / static_cast<float>(count);
  const float radius = std::sqrt(1.0f - y * y);
  const float phi = golden_angle * static_cast<float>(i);
  return {radius * std::cos(phi), y, radius * std::sin(phi)};
}

/// Half the extent of the box along a unit axis.
float half_extent(const Box3& box, const vec3& axis) { return 0.5f * glm::dot(box.size(), glm::abs(axis)); }

int pixels_to_cover(float extent, float pixel_size) {
  constexpr float kMaxPixels = 1 << 16;  // keeps hostile ratios within int; no evaluation is this large
  constexpr float kRounding = 1e-4f;     // an extent of 16.00001 pixels is 16 pixels
  return static_cast<int>(std::clamp(std::ceil(extent / pixel_size - kRounding), 0.0f, kMaxPixels)) + 2;
}

}  // namespace

std::vector<vec3> view_directions(int count) {
  std::vector<vec3> directions;
  if (count <= 12) {
    std::array<vec3, 12> vertices = icosahedron_vertices();
    order_farthest_first(vertices);
    // The camera at a vertex looks back at the centre.
    for (int i = 0; i < count; ++i) directions.push_back(-vertices[static_cast<size_t>(i)]);
  } else {
    for (int i = 0; i < count; ++i) directions.push_back(-fibonacci_direction(i, count));
  }
  return directions;
}

OrthoView frame_view(const Box3& bounds, const vec3& direction, float pixel_size) {
  OrthoView view;
  view.direction = glm::normalize(direction);
  const bool along_y = std::abs(view.direction.y) > 0.999f;
  const vec3 pole = along_y ? vec3(1.0f, 0.0f, 0.0f) : vec3(0.0f, 1.0f, 0.0f);
  view.up = glm::normalize(pole - glm::dot(pole, view.direction) * view.direction);
  view.center = bounds.is_empty() ? vec3(0.0f) : bounds.center();
  view.pixel_size = pixel_size;
  view.width_px = pixels_to_cover(2.0f * half_extent(bounds, view.right()), pixel_size);
  view.height_px = pixels_to_cover(2.0f * half_extent(bounds, view.up), pixel_size);
  return view;
}

}  // namespace farfield
