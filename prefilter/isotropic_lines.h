// SPDX-License-Identifier: Apache-2.0
// Lines through a box, none of which is more likely than another: what cameras and lights around an asset send in.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/hash.h"
#include "prefilter/voxel_walk.h"

namespace farfield {

/// Area of the box's surface.
inline double surface_area(const VoxelBox& box) {
  const dvec3 s = box.upper - box.lower;
  return 2 * (s.x * s.y + s.y * s.z + s.z * s.x);
}

/// Five coordinates in [0, 1) of each line of a sequence whose every stretch covers the box evenly: multiples of powers
/// of the root of x^6 = x + 1, modulo 1 [Roberts 2018].
inline std::array<double, 5> even_coordinates(uint64_t index, uint64_t seed) {
  constexpr double kRoot = 1.1347241384015194;
  std::array<double, 5> result;
  double step = 1;
  for (size_t d = 0; d < result.size(); ++d) {
    step /= kRoot;
    const auto step_bits = static_cast<uint64_t>(step * 0x1p53) << 11;
    result[d] = static_cast<double>((mix64(seed, d) + index * step_bits) >> 11) * 0x1p-53;
  }
  return result;
}

/// A uniformly distributed line through the box for uniform coordinates, as a ray that starts on its surface; `far` is
/// where it leaves. Points are uniform on the surface and directions have a cosine lobe there, which is just that
/// [Santalo 1976]. The box has some area.
inline VoxelRay isotropic_line(const VoxelBox& box, const std::array<double, 5>& coordinates) {
  const dvec3 size = box.upper - box.lower;
  const dvec3 area(size.y * size.z, size.z * size.x, size.x * size.y);
  const double pick = 2 * coordinates[0], on_side = pick < 1 ? pick : pick - 1;
  double left = on_side * (area.x + area.y + area.z);
  int axis = 0;
  while (axis < 2 && left >= area[axis]) left -= area[axis++];
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const bool is_lower = pick < 1;

  VoxelRay ray;
  ray.origin[axis] = is_lower ? box.lower[axis] : box.upper[axis];
  ray.origin[u] = box.lower[u] + coordinates[1] * size[u];
  ray.origin[v] = box.lower[v] + coordinates[2] * size[v];
  const double sine2 = coordinates[3], cosine = std::sqrt(1 - sine2), azimuth = 2 * M_PI * coordinates[4];
  ray.direction[axis] = is_lower ? cosine : -cosine;
  ray.direction[u] = std::sqrt(sine2) * std::cos(azimuth);
  ray.direction[v] = std::sqrt(sine2) * std::sin(azimuth);

  ray.far = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (ray.direction[a] == 0) continue;
    const double wall = ray.direction[a] > 0 ? box.upper[a] : box.lower[a];
    ray.far = std::min(ray.far, (wall - ray.origin[a]) / ray.direction[a]);
  }
  ray.far = std::max(ray.far, 0.0);
  return ray;
}

}  // namespace farfield
