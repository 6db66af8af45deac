// SPDX-License-Identifier: Apache-2.0
#include "bvh/instance_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/key_place.h"

namespace farfield {

namespace {

// An instance may shrink on its way between two keys to this share of its volume at the smaller of them: what its
// inverse keeps of a float's digits.
constexpr double kLeastVolume = 1e-6;

/// A transform in double: rays far from the origin want the digits.
struct Transform {
  glm::dmat3 linear;
  glm::dvec3 translation;

  explicit Transform(const mat4x3& m)
      : linear(glm::dvec3(m[0]), glm::dvec3(m[1]), glm::dvec3(m[2])), translation(m[3]) {}
  Transform(const Transform& a, const Transform& b, double t)
      : linear(a.linear * (1.0 - t) + b.linear * t), translation(glm::mix(a.translation, b.translation, t)) {}
};

/// The least |determinant| on the way from a to b, and 0 if it changes its sign there.
double least_volume(const mat4x3& a, const mat4x3& b) {
  const Transform start(a), end(b);
  const auto volume = [&](double t) { return glm::determinant(Transform(start, end, t).linear); };
  // A cubic c0 + c1 t + c2 t^2 + c3 t^3 from four of its values; it is least at an end or where it is level.
  const double c0 = volume(0.0), y1 = volume(1.0 / 3), y2 = volume(2.0 / 3), y3 = volume(1.0);
  const double c1 = -5.5 * c0 + 9.0 * y1 - 4.5 * y2 + y3;
  const double c2 = 9.0 * c0 - 22.5 * y1 + 18.0 * y2 - 4.5 * y3;
  const double c3 = 4.5 * (-c0 + 3.0 * y1 - 3.0 * y2 + y3);
  double least = std::min(std::abs(c0), std::abs(y3));
  const auto look_at = [&](double t) {
    if (t > 0.0 && t < 1.0) least = std::min(least, volume(t) * (c0 < 0.0 ? -1.0 : 1.0));
  };
  if (c0 * y3 <= 0.0) return 0.0;
  const double half = c2 * c2 - 3.0 * c3 * c1;  // of the roots of c1 + 2 c2 t + 3 c3 t^2
  if (half < 0.0) return least;
  const double q = -(c2 + std::copysign(std::sqrt(half), c2));
  if (c3 != 0.0) look_at(q / (3.0 * c3));
  if (q != 0.0) look_at(c1 / q);
  return std::max(least, 0.0);
}

}  // namespace

Result<InstanceMotion> InstanceMotion::make(std::span<const mat4x3> keys) {
  const auto invalid = [](const std::string& why) { return make_error(ErrorCode::InvalidArgument, why); };
  if (keys.size() < 2 || keys.size() > kMostKeys) {
    return invalid(fmt::format("a motion has 2 to {} keys, not {}", kMostKeys, keys.size()));
  }
  for (const mat4x3& key : keys) FARFIELD_TRY(make_instance(0, key));
  for (size_t i = 0; i + 1 < keys.size(); ++i) {
    const auto volume = [&](size_t k) { return std::abs(glm::determinant(Transform(keys[k]).linear)); };
    if (least_volume(keys[i], keys[i + 1]) >= kLeastVolume * std::min(volume(i), volume(i + 1))) continue;
    return invalid(
        fmt::format("between keys {} and {} of its motion the instance is squeezed flat, as halfway through a turn by "
                    "180 degrees or on the way to its mirror image; give more keys",
                    i, i + 1));
  }
  return InstanceMotion(keys);
}

InstanceRecord InstanceMotion::at(const InstanceRecord& record, float time) const {
  const auto [key, t] = find_key_place(keys_.size(), time);
  const Transform now(Transform(keys_[key]), Transform(keys_[key + 1]), t);
  const glm::dmat3 inverse = glm::inverse(now.linear);
  InstanceRecord moved = record;
  moved.set_inverse(inverse, -(inverse * now.translation));
  return moved;
}

}  // namespace farfield
