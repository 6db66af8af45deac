// SPDX-License-Identifier: Apache-2.0
#include "bvh/instance_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/affine.h"
#include "bvh/ray_lanes.h"

namespace farfield {

vec3 InstanceRecord::normal_to_world(const vec3& n) const {
  const auto& m = world_to_local;
  return static_cast<float>(handedness) * vec3(glm::dot(m[0], n), glm::dot(m[1], n), glm::dot(m[2], n));
}

mat3 InstanceRecord::linear_to_local() const { return mat3(world_to_local[0], world_to_local[1], world_to_local[2]); }

void InstanceRecord::set_inverse(const glm::dmat3& linear, const glm::dvec3& translation) {
  for (int axis = 0; axis < 3; ++axis) world_to_local[axis] = vec3(linear[axis]);
  world_to_local[3] = vec3(translation);
  handedness = glm::determinant(linear) < 0.0 ? -1 : 1;
}

Result<InstanceRecord> make_instance(uint32_t asset, const mat4x3& local_to_world) {
  const auto invalid = [](const char* why) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("the instance's transform {}", why));
  };
  const glm::dmat4x3 to_world(local_to_world);
  if (!is_in_range(to_world)) return invalid("is not finite, or beyond 1.8e18");
  const glm::dmat4x3 to_local = inverse_of(to_world);
  if (glm::determinant(glm::dmat3(to_world)) == 0.0 || !is_in_range(to_local)) {
    return invalid("cannot be inverted: give every axis a length that is not zero");
  }
  InstanceRecord record;
  record.asset = asset;
  record.set_inverse(glm::dmat3(to_local), to_local[3]);
  return record;
}

InstanceRecord placed(const InstanceRecord& instance, const PartPlacement& placement) {
  const glm::dmat3 outer = linear_part(instance.world_to_local), inner = linear_part(placement.level_to_part);
  InstanceRecord result = instance;
  result.set_inverse(inner * outer,
                     inner * glm::dvec3(instance.world_to_local[3]) + glm::dvec3(placement.level_to_part[3]));
  return result;
}

float largest_stretch(const mat4x3& local_to_world) {
  // The largest eigenvalue of A^T A by its trigonometric closed form [Smith 1961].
  const glm::dmat3 a = linear_part(local_to_world);
  const glm::dmat3 b = glm::transpose(a) * a;
  const double mean = (b[0][0] + b[1][1] + b[2][2]) / 3.0;
  const double off = b[1][0] * b[1][0] + b[2][0] * b[2][0] + b[2][1] * b[2][1];
  const glm::dvec3 diagonal(b[0][0] - mean, b[1][1] - mean, b[2][2] - mean);
  const double spread = std::sqrt((glm::dot(diagonal, diagonal) + 2.0 * off) / 6.0);
  if (!(spread > 0.0)) return static_cast<float>(std::sqrt(mean));
  const double half_det = glm::determinant((b - mean * glm::dmat3(1.0)) / spread) / 2.0;
  const double angle = std::acos(std::clamp(half_det, -1.0, 1.0)) / 3.0;
  return static_cast<float>(std::sqrt(mean + 2.0 * spread * std::cos(angle)));
}

Box3 instance_bounds(const InstanceRecord& instance, const TracedAsset& asset) {
  // From the rounded inverse that rays really use.
  const glm::dmat3 to_world = glm::inverse(glm::dmat3(instance.linear_to_local()));
  const glm::dvec3 back(instance.world_to_local[3]);
  Box3 bounds;
  const auto extend = [&](const vec3& p) { bounds.extend(vec3(to_world * (glm::dvec3(p) - back))); };
  if (asset.hull.empty()) {
    for (int i = 0; i < 8; ++i) extend(asset.bounds.corner(i));
  }
  for (const vec3& p : asset.hull) extend(p);
  return padded_for_local_rays(bounds);
}

}  // namespace farfield
