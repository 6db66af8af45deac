// SPDX-License-Identifier: Apache-2.0
#include "bvh/see_through.h"

#include <bit>

#include "base/hash.h"
#include "cache/level_values.h"

namespace farfield {

float path_number(const RayContext& context, const EmbreeRay& ray, float cell, uint64_t salt) {
  const vec3 at = vec3(ray.org_x, ray.org_y, ray.org_z) + ray.tfar * vec3(ray.dir_x, ray.dir_y, ray.dir_z);
  // Planes lie at round numbers: were cubes' sides there, rounding would decide which of two a hit is in.
  constexpr float kOffset = 0.3819660f;
  const vec3 cube = glm::floor(at / cell + kOffset);
  uint64_t bits = context.path_seed ^ salt;
  for (int axis = 0; axis < 3; ++axis) bits = mix64(bits, std::bit_cast<uint32_t>(cube[axis] + 0.0f));
  return to_unit_float(bits);
}

float ray_number(const RayContext& context, const EmbreeRay& ray, uint32_t face) {
  return to_unit_float(mix64(mix64(context.ray_seed, face), std::bit_cast<uint32_t>(ray.tfar)));
}

float gap_along(const LevelView& level, uint32_t face, const EmbreeRay& ray, const EmbreeHit& hit) {
  if (level.face_gap.empty() || level.face_gap[face] == 0) return 0;
  const vec3 normal(hit.Ng_x, hit.Ng_y, hit.Ng_z);
  return gap_towards(level, face, glm::normalize(normal), vec3(ray.dir_x, ray.dir_y, ray.dir_z));
}

float opacity_at(const TracedLevel& level, const RayContext& context, const EmbreeRay& ray, uint32_t quad,
                 uint32_t face, const vec2& barycentric) {
  if (level.view.face_opacity.empty()) return 1.0f;
  const uint8_t average = level.view.face_opacity[face];
  if (average == 255 || average == 0 || !level.look) return unpack_unorm8(average);
  const vec3 direction(ray.dir_x, ray.dir_y, ray.dir_z);
  // The ray is in local space, but t is the world's: cones are in world units, along a unit direction there.
  const float width = context.width_at(ray.tfar) * glm::length(direction);
  return level.look->opacity(level.view, {quad, face, barycentric, direction, width});
}

void opacity_filter(const EmbreeFilterArguments* args) {
  if (args->valid[0] != -1) return;
  const auto& level = *static_cast<const TracedLevel*>(args->geometryUserPtr);
  const auto& context = *reinterpret_cast<const RayContext*>(args->context);
  const auto& ray = *reinterpret_cast<const EmbreeRay*>(args->ray);
  const auto& hit = *reinterpret_cast<const EmbreeHit*>(args->hit);
  const uint32_t quad = level.view.quad_of(hit.geomID, hit.primID);
  const uint32_t face = level.face_of(quad, quad_side(hit.u, hit.v));
  const float gap = gap_along(level.view, face, ray, hit);
  if (gap > 0 && path_number(context, ray, kGapCell * level.view.header.resolution, 0) < gap) {
    args->valid[0] = 0;
    return;
  }
  const float opacity = opacity_at(level, context, ray, quad, face, face_barycentric(hit.u, hit.v));
  if (opacity < 1 && !(ray_number(context, ray, face) < opacity)) args->valid[0] = 0;
}

}  // namespace farfield
