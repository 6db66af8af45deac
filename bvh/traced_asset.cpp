// SPDX-License-Identifier: Apache-2.0
#include "bvh/traced_asset.h"

#include <bit>

#include "base/hash.h"
#include "farfield/ray.h"

namespace farfield {
namespace {

/// Whether the path of a ray passes between the pieces that a face stands for. All faces within a few resolutions give
/// the same path the same answer: a wall's front and back have the same gaps, and so have camera and shadow rays.
bool passes_gap(const TracedLevel& level, const RayContext& context, const EmbreeRay& ray, uint32_t face) {
  constexpr float kCell = 4;  // resolutions
  if (level.view.face_gap.empty()) return false;
  const uint8_t gap = level.view.face_gap[face];
  if (gap == 0) return false;
  const vec3 at = vec3(ray.org_x, ray.org_y, ray.org_z) + ray.tfar * vec3(ray.dir_x, ray.dir_y, ray.dir_z);
  const vec3 cell = glm::floor(at / (kCell * level.view.header.resolution));
  uint64_t bits = context.path_seed;
  for (int axis = 0; axis < 3; ++axis) bits = mix64(bits, std::bit_cast<uint32_t>(cell[axis] + 0.0f));
  return to_unit_float(bits) < unpack_unorm8(gap);
}

/// Whether a ray of ours stops at a face that is not opaque everywhere. The same ray gets the same answer.
bool stops(const TracedLevel& level, const RayContext& context, const EmbreeRay& ray, const EmbreeHit& hit) {
  const uint32_t face = level.face_of(hit.primID, quad_side(hit.u, hit.v));
  if (passes_gap(level, context, ray, face)) return false;
  if (level.view.face_opacity.empty()) return true;
  const uint8_t average = level.view.face_opacity[face];
  if (average == 255 || average == 0) return average == 255;
  float opacity = unpack_unorm8(average);
  if (level.look) {
    const vec3 direction(ray.dir_x, ray.dir_y, ray.dir_z);
    // The ray is in local space, but t is the world's: cones are in world units, along a unit direction there.
    const float width = (context.cone_width + context.cone_spread * ray.tfar) * glm::length(direction);
    opacity = level.look->opacity(level.view, {hit.primID, face, face_barycentric(hit.u, hit.v), direction, width});
  }
  const uint64_t bits = mix64(mix64(context.ray_seed, face), std::bit_cast<uint32_t>(ray.tfar));
  return to_unit_float(bits) < opacity;
}

/// Embree asks it about every hit on a level whose faces are not all opaque and whole. Such rays are single:
/// InstanceGeometry takes packets apart.
void opacity_filter(const EmbreeFilterArguments* args) {
  if (args->valid[0] != -1) return;
  const auto& level = *static_cast<const TracedLevel*>(args->geometryUserPtr);
  const auto& context = *reinterpret_cast<const RayContext*>(args->context);
  const auto& ray = *reinterpret_cast<const EmbreeRay*>(args->ray);
  const auto& hit = *reinterpret_cast<const EmbreeHit*>(args->hit);
  if (!stops(level, context, ray, hit)) args->valid[0] = 0;
}

}  // namespace

Result<std::unique_ptr<TracedLevel>> TracedLevel::build(BvhDevice& device, const LevelView& level, uint32_t slot,
                                                        const SurfaceLook* look, uint64_t most_bytes) {
  std::unique_ptr<TracedLevel> traced(new TracedLevel);
  traced->view = level;
  traced->volume = BrickVolume(level);
  traced->slot = slot;
  traced->face_count = farfield::face_count(level);
  traced->voxel_count = farfield::voxel_count(level);
  traced->look = look;
  const bool is_opaque = level.face_opacity.empty() && level.face_gap.empty();
  FARFIELD_TRY_LET(traced->scene,
                   LevelScene::build(device, level, most_bytes, is_opaque ? nullptr : opacity_filter, traced.get()));
  return traced;
}

}  // namespace farfield
