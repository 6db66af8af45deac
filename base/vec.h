// SPDX-License-Identifier: Apache-2.0
// Vector types of the whole project: GLM's, under one spelling, plus the axis-aligned box.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <limits>

namespace farfield {

using glm::dvec3;
using glm::ivec3;
using glm::mat3;
using glm::mat4x3;
using glm::uvec3;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;

/// The largest coordinate that Embree takes.
inline constexpr float kEmbreeLargest = 1.8e18f;

/// Axis-aligned box. Default constructed it is empty: lower > upper, and extending it by a point gives that point.
struct Box3 {
  vec3 lower{std::numeric_limits<float>::infinity()};
  vec3 upper{-std::numeric_limits<float>::infinity()};

  bool is_empty() const { return lower.x > upper.x || lower.y > upper.y || lower.z > upper.z; }
  /// Extent along each axis; zero for the empty box.
  vec3 size() const { return is_empty() ? vec3(0.0f) : upper - lower; }
  vec3 center() const { return 0.5f * (lower + upper); }
  /// Corner i in [0, 8): bit a says whether it is the upper one along axis a.
  vec3 corner(int i) const { return {i & 1 ? upper.x : lower.x, i & 2 ? upper.y : lower.y, i & 4 ? upper.z : lower.z}; }
  void extend(const vec3& point) {
    lower = glm::min(lower, point);
    upper = glm::max(upper, point);
  }
  void extend(const Box3& box) {
    lower = glm::min(lower, box.lower);
    upper = glm::max(upper, box.upper);
  }
};

inline float component_sum(const vec3& v) { return v.x + v.y + v.z; }
inline float max_component(const vec3& v) { return std::max(v.x, std::max(v.y, v.z)); }
inline float min_component(const vec3& v) { return std::min(v.x, std::min(v.y, v.z)); }
inline bool is_finite(const vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// An orthonormal basis around a unit vector, without branches near the pole [Duff et al. 2017].
template <typename T>
struct BasicFrame {
  using Vec = glm::vec<3, T>;
  Vec x, y, z;

  explicit BasicFrame(const Vec& unit_z) : z(unit_z) {
    const T sign = std::copysign(T(1), z.z);
    const T a = T(-1) / (sign + z.z);
    const T b = z.x * z.y * a;
    x = Vec(T(1) + sign * z.x * z.x * a, sign * b, -sign * z.x);
    y = Vec(b, sign + z.y * z.y * a, -z.y);
  }
  Vec to_world(const Vec& v) const { return v.x * x + v.y * y + v.z * z; }
  Vec to_local(const Vec& v) const { return {glm::dot(v, x), glm::dot(v, y), glm::dot(v, z)}; }
};
using Frame = BasicFrame<float>;

}  // namespace farfield
