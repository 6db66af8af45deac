// SPDX-License-Identifier: Apache-2.0
// Scattering in world space. A level's models live in the instance's local space; under the instance's transform M
// (points), normals go with M^-T, and so does the distribution of normals: S_world = M^-T S M^-1, up to scale.
// Then sqrt(w^T S_world w) is proportional to sqrt(d^T S d) for d = M^-1 w, which is what free flights in local space
// use: transmittance and phase function agree under any affine transform.
#include "farfield/interaction.h"

#include <algorithm>
#include <new>
#include <type_traits>

#include "runtime/interaction_model.h"

namespace farfield {

namespace {

using detail::InteractionModel;

static_assert(sizeof(InteractionModel) <= 256 && alignof(InteractionModel) <= 16);
static_assert(std::is_trivially_copyable_v<InteractionModel> && std::is_trivially_destructible_v<InteractionModel>);

// A hit is off its surface by a few roundings of the coordinates that went into it: the ray's origin, the way to the
// hit, and the transform's translation, each 2^-24 of its size. Over random transforms (runtime_test), a factor of 1
// leaves self-hits and 4 leaves none; 16 is that with a margin, and 1e-6 of the scene.
constexpr float kOffsetRoundings = 16.0f * 0x1p-24f;

// next_cone_spread: a sampled direction stands for a lobe of solid angle about 1 / pdf, a cone of spread
// 2 sqrt(1 / (pi pdf)). This is the share of that spread which one path's ray covers: 1/8 makes 0.25 rad of the middle
// of a cosine lobe, 0.5 rad of an isotropic phase function, and next to nothing of a mirror.
constexpr float kConeShare = 0.125f;
constexpr float kWidestCone = 1.0f;  // rad

float largest(const vec3& v) { return max_component(glm::abs(v)); }

/// The linear part of the instance's inverse transform, divided by its largest entry so that squares and determinants
/// of extreme transforms neither overflow nor vanish.
struct ScaledInverse {
  mat3 matrix;
  float scale;

  explicit ScaledInverse(const InstanceRecord& instance) : matrix(instance.linear_to_local()) {
    scale = std::max(largest(matrix[0]), std::max(largest(matrix[1]), largest(matrix[2])));
    matrix /= scale;
  }
};

/// S in world space, trace 1.
SymMat3 to_world(const SymMat3& s, const InstanceRecord& instance) {
  const SymMat3 world = congruence(glm::transpose(ScaledInverse(instance).matrix), s);
  const float trace = world.trace();
  return trace > 0.0f ? world * (1.0f / trace) : world;
}

vec3 color_at(ArrayView<PackedColor> colors, uint32_t i) {
  return colors.empty() ? vec3(0.0f) : unpack_color(colors[i]);
}

float unorm_at(ArrayView<uint8_t> values, uint32_t i) { return values.empty() ? 1.0f : unpack_unorm8(values[i]); }

/// The face that HitRecord::element (2 * quad + side of its diagonal) means.
uint32_t face_of(const TracedLevel& level, uint32_t element) {
  const uint32_t quad = element / 2;
  const ArrayView<uint32_t> first_face = level.view.quad_first_face;
  const uint32_t next = quad + 1 < first_face.size() ? first_face[quad + 1] : level.face_count;
  const bool is_pair = next - first_face[quad] == 2;  // not from `quads`: their pages were given back after the build
  return first_face[quad] + (is_pair ? element % 2 : 0);  // at a lone triangle's edge rounding may have said 1
}

SurfaceParams surface_params(const LevelView& level, const InstanceRecord& instance, uint32_t face,
                             const vec3& normal) {
  SurfaceParams params;
  params.sggx = level.face_sggx.empty() ? SymMat3::outer(normal) : to_world(unpack(level.face_sggx[face]), instance);
  params.diffuse = color_at(level.face_diffuse, face);
  params.specular = color_at(level.face_specular, face);
  params.transmission = color_at(level.face_transmission, face);
  params.roughness2 = unorm_at(level.face_roughness2, face);
  return params;
}

FlakeParams flake_params(const LevelView& level, const InstanceRecord& instance, uint32_t voxel) {
  FlakeParams params;
  params.sggx = to_world(level.voxel_sggx.empty() ? SymMat3::identity() : unpack(level.voxel_sggx[voxel]), instance);
  params.diffuse = color_at(level.voxel_diffuse, voxel);
  params.specular = color_at(level.voxel_specular, voxel);
  params.transmission = color_at(level.voxel_transmission, voxel);
  params.roughness2 = unorm_at(level.voxel_roughness2, voxel);
  params.self_shadowing = unorm_at(level.voxel_self_shadowing, voxel);
  return params;
}

/// The distance along the normal that clears all rounding of a hit. The transform's translation is no longer than the
/// way to the hit and the size of the asset, in the world, together.
float ray_offset(const InstanceRecord& instance, const vec3& origin, const vec3& position, const Box3& local_bounds) {
  const ScaledInverse inverse(instance);
  const mat3 to_world(glm::inverse(glm::dmat3(inverse.matrix)));  // its determinant may be no float
  const vec3 corner = glm::max(glm::abs(local_bounds.lower), glm::abs(local_bounds.upper)) / inverse.scale;
  const float asset_size =
      glm::length(to_world[0]) * corner.x + glm::length(to_world[1]) * corner.y + glm::length(to_world[2]) * corner.z;
  return kOffsetRoundings * (largest(origin) + largest(position) + glm::length(position - origin) + asset_size);
}

}  // namespace

const InteractionModel& InteractionModel::of(const Interaction& interaction) {
  return *std::launder(reinterpret_cast<const InteractionModel*>(interaction.model_));
}

void InteractionModel::put(Interaction& interaction, const InteractionModel& model) {
  new (interaction.model_) InteractionModel(model);
}

bool is_hit_of(const TracedLevel& level, const HitRecord& hit) {
  return hit.is_volume ? hit.element < level.voxel_count : hit.element / 2 < level.view.quad_first_face.size();
}

Interaction make_interaction(const TracedLevel& level, const InstanceRecord& instance, const RTCRayHit& ray_hit,
                             const HitRecord& hit) {
  const LevelView& view = level.view;
  const RTCRay& ray = ray_hit.ray;
  const vec3 origin(ray.org_x, ray.org_y, ray.org_z);
  const vec3 direction(ray.dir_x, ray.dir_y, ray.dir_z);

  Interaction interaction;
  interaction.position = vec3(glm::dvec3(origin) + static_cast<double>(ray.tfar) * glm::dvec3(direction));
  interaction.wo = -glm::normalize(direction);
  interaction.footprint = hit.footprint;
  interaction.instance = hit.instance;
  interaction.level = view.header.level;
  interaction.lambda = hit.lambda;

  if (hit.is_volume) {
    interaction.kind = Interaction::Kind::Volume;
    const FlakeParams params = flake_params(view, instance, hit.element);
    interaction.albedo = params.diffuse + params.specular + params.transmission;
    InteractionModel::put(interaction, InteractionModel(FlakePhase(params, interaction.wo)));
    return interaction;
  }
  interaction.kind = Interaction::Kind::Surface;
  const vec3 normal_local(hit.normal_local[0], hit.normal_local[1], hit.normal_local[2]);
  const vec3 normal = glm::normalize(instance.normal_to_world(glm::normalize(normal_local)));
  interaction.geometric_normal = glm::dot(normal, interaction.wo) < 0.0f ? -normal : normal;
  const SurfaceParams params =
      surface_params(view, instance, face_of(level, hit.element), interaction.geometric_normal);
  interaction.albedo = params.diffuse + params.specular + params.transmission;
  InteractionModel::put(interaction,
                        InteractionModel(SurfaceBsdf(params, interaction.geometric_normal, interaction.wo),
                                         ray_offset(instance, origin, interaction.position, view.header.bounds)));
  return interaction;
}

vec3 Interaction::ray_origin(const vec3& wi) const {
  if (kind != Kind::Surface) return position;
  const float side = glm::dot(wi, geometric_normal) < 0.0f ? -1.0f : 1.0f;
  return position + side * InteractionModel::of(*this).offset * geometric_normal;
}

ScatterSample Interaction::sample(Rng& rng) const {
  if (kind == Kind::None) return {};
  const InteractionModel& model = InteractionModel::of(*this);
  return kind == Kind::Surface ? model.surface.sample(rng) : model.flakes.sample(rng);
}

glm::vec3 Interaction::eval(const glm::vec3& wi, Rng& rng) const {
  if (kind == Kind::None) return vec3(0.0f);
  const InteractionModel& model = InteractionModel::of(*this);
  return kind == Kind::Surface ? model.surface.eval(wi, rng) : model.flakes.eval(wi, rng);
}

float Interaction::pdf(const glm::vec3& wi) const {
  if (kind == Kind::None) return 0.0f;
  const InteractionModel& model = InteractionModel::of(*this);
  return kind == Kind::Surface ? model.surface.pdf(wi) : model.flakes.pdf(wi);
}

float Interaction::next_cone_spread(const ScatterSample& sample, float cone_spread) const {
  if (!(sample.pdf > 0.0f)) return cone_spread;
  const float lobe = 2.0f * std::sqrt(1.0f / (kPi * sample.pdf));
  return cone_spread + std::min(kConeShare * lobe, kWidestCone);
}

}  // namespace farfield
