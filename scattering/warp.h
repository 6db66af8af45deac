// SPDX-License-Identifier: Apache-2.0
// Uniform numbers in [0, 1) to directions: the closed-form warps that the samplers of this room are made of.
#pragma once

#include <algorithm>
#include <cmath>

#include "scattering/convention.h"

namespace farfield {

/// The unit vector with the given height over the xy plane and azimuth 2 pi u. z is clamped to [-1, 1].
template <typename T>
Vec3<T> direction_at_height(T z, T u) {
  const T r = std::sqrt(std::max(T(0), (T(1) - z) * (T(1) + z)));
  const T phi = T(2) * kPiOf<T> * u;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

/// Uniform on the sphere: density 1 / (4 pi).
template <typename T>
Vec3<T> uniform_sphere(T u1, T u2) {
  return direction_at_height(T(1) - T(2) * u1, u2);
}

/// Cosine lobe about unit n: density <n.w> / pi. n.w > 0 always.
template <typename T>
Vec3<T> cosine_lobe(const Vec3<T>& n, T u1, T u2) {
  return BasicFrame<T>(n).to_world(direction_at_height(std::sqrt(T(1) - u1), u2));
}

/// w mirrored at unit m.
template <typename T>
Vec3<T> reflect_about(const Vec3<T>& w, const Vec3<T>& m) {
  return T(2) * glm::dot(w, m) * m - w;
}

/// Where |wo + wi|^2 is below this, the half vector is meaningless and D(h) is taken as 0 (docs/theory.md,
/// section 10.6).
inline constexpr double kSmallestHalfVector2 = 1e-12;

/// (wo + wi) / |wo + wi|, or 0 when the directions are opposite.
template <typename T>
Vec3<T> half_vector(const Vec3<T>& wo, const Vec3<T>& wi) {
  const Vec3<T> h = wo + wi;
  const T length2 = glm::dot(h, h);
  return length2 < T(kSmallestHalfVector2) ? Vec3<T>(0) : h / std::sqrt(length2);
}

}  // namespace farfield
