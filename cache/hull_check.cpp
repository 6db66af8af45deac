// SPDX-License-Identifier: Apache-2.0
#include "cache/hull_check.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/nonfinite.h"
#include "cache/placed_parts.h"

namespace farfield {

namespace {

constexpr size_t kDirections = 64;

/// How far something reaches along each direction.
class Reach {
 public:
  Reach() { along_.fill(-kInfinity); }

  void extend(const vec3& point, float radius = 0.0f) {
    const Directions& to = directions();
    for (size_t i = 0; i < kDirections; ++i) {  // one instruction for several directions: no sum over them
      const float reach = point.x * to.x[i] + point.y * to.y[i] + point.z * to.z[i] + radius;
      along_[i] = reach > along_[i] ? reach : along_[i];
    }
  }
  /// The most by which this reaches beyond `other`.
  float beyond(const Reach& other) const {
    float most = -kInfinity;
    for (size_t i = 0; i < kDirections; ++i) most = std::max(most, along_[i] - other.along_[i]);
    return most;
  }

 private:
  struct Directions {
    std::array<float, kDirections> x, y, z;
  };
  /// A Fibonacci spiral over the sphere.
  static const Directions& directions() {
    static const Directions all = [] {
      Directions spiral;
      for (size_t i = 0; i < kDirections; ++i) {
        const float z = 1.0f - (2.0f * static_cast<float>(i) + 1.0f) / static_cast<float>(kDirections);
        const float phi = 2.39996323f * static_cast<float>(i);  // the golden angle
        const float radius = std::sqrt(1.0f - z * z);
        spiral.x[i] = radius * std::cos(phi), spiral.y[i] = radius * std::sin(phi), spiral.z[i] = z;
      }
      return spiral;
    }();
    return all;
  }

  std::array<float, kDirections> along_;
};

void extend_by_voxels(Reach& reach, const LevelView& level, const Brick& brick, const ivec3& corner) {
  for (int i = 0; i < kBrickVoxels; ++i) {
    if (brick.density[static_cast<size_t>(i)] == 0) continue;
    const ivec3 voxel = corner + ivec3(i % 8, i / 8 % 8, i / 64);
    reach.extend(level.header.volume_origin + (vec3(voxel) + 0.5f) * level.header.resolution);
  }
}

}  // namespace

float reach_out_of_hull(const LevelView& level, std::span<const vec3> hull) {
  if (hull.empty()) return -kInfinity;
  Reach allowed, reach;
  for (const vec3& point : hull) allowed.extend(point);
  for_each_surface_point(level, [&](const vec3& point) { reach.extend(point); });
  for_each_brick(level, [&](const Brick& brick, const ivec3& coordinates) {
    const ivec3 corner = coordinates * kBrickSide;
    const float half_side = 0.5f * static_cast<float>(kBrickSide);
    Reach whole;  // most bricks lie well inside
    whole.extend(level.header.volume_origin + (vec3(corner) + half_side) * level.header.resolution,
                 1.7321f * half_side * level.header.resolution);
    if (whole.beyond(allowed) > 0.0f) extend_by_voxels(reach, level, brick, corner);
  });
  return reach.beyond(allowed);
}

float hull_slack(const Box3& bounds) { return 1e-4f * glm::length(bounds.size()); }

}  // namespace farfield
