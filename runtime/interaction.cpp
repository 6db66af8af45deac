// SPDX-License-Identifier: Apache-2.0
// Scattering in world space. A level's models live in the instance's local space; under the instance's transform M
// (points), normals go with M^-T, and so does the distribution of normals: S_world = M^-T S M^-1, up to scale.
// Then sqrt(w^T S_world w) is proportional to sqrt(d^T S d) for d = M^-1 w, which is what free flights in local space
// use: transmittance and phase function agree under any affine transform.
#include "farfield/interaction.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <optional>
#include <type_traits>
#include <utility>

#include "cache/level_values.h"
#include "runtime/close_up.h"
#include "runtime/interaction_model.h"
#include "scattering/albedo.h"
#include "scattering/material_model.h"
#include "scattering/visible_normal.h"

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
SymMat3 to_world(const SymMat3& s, const ScaledInverse& inverse) {
  const SymMat3 world = congruence(glm::transpose(inverse.matrix), s);
  const float trace = world.trace();
  return trace > 0.0f ? world * (1.0f / trace) : world;
}

/// The normal around which a distribution lies, and how far it spreads: like the roughness2 of a GGX lobe
/// (docs/decisions/0011).
struct MainNormal {
  vec3 normal;
  float roughness2;
};
MainNormal main_normal(const SymMat3& s, const vec3& start) {
  const float trace = s.trace();
  vec3 normal = start;
  for (int i = 0; i < 4; ++i) {  // power iterations: where a second direction is as strong, `start` has a say
    const vec3 next = s * normal;
    const float length = glm::length(next);
    if (!(length > 1e-6f * trace)) return {start, 1.0f};
    normal = next / length;
  }
  const float aside = 0.5f * std::clamp(1 - s.quadratic(normal) / trace, 0.0f, 2.0f / 3);
  return {normal, roughness2_of_spread(aside)};
}

void set_sggx(Reflectance& reflectance, const SymMat3& s) {
  const float entries[] = {s.xx, s.yy, s.zz, s.xy, s.xz, s.yz};
  std::ranges::copy(entries, reflectance.sggx);
}

/// What faces and flakes have in common.
template <typename Params>
void set_reflectance(Reflectance& reflectance, const Params& params) {
  reflectance.diffuse = params.diffuse;
  reflectance.specular = params.specular;
  reflectance.transmission = params.transmission;
  reflectance.roughness = std::sqrt(std::sqrt(params.roughness2));
}

/// Turned with the flakes, and as long as it was.
vec3 open_side_to_world(const vec3& open_side, const ScaledInverse& inverse) {
  return glm::length(open_side) * glm::normalize(glm::transpose(inverse.matrix) * open_side);
}

FlakeParams world_flake_params(const LevelView& level, const InstanceRecord& instance, uint32_t voxel) {
  const ScaledInverse inverse(instance);
  FlakeParams params = flake_params(level, voxel);
  params.sggx = to_world(params.sggx, inverse);
  if (params.open_side != vec3(0.0f)) params.open_side = open_side_to_world(params.open_side, inverse);
  return params;
}

FogParams world_fog_params(const LevelView& level, const InstanceRecord& instance, uint32_t voxel) {
  FogParams params = fog_params(level, voxel);
  if (params.has_shape) params.sggx = to_world(params.sggx, ScaledInverse(instance));
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
  const LevelView& view = level.view;
  if (hit.is_volume) return hit.element < level.voxel_count;
  const bool is_at_a_place = hit.placement == kNoPlacement || hit.placement < view.placements.size();
  return is_at_a_place && hit.element / 2 < view.quad_first_face.size();
}

namespace {

/// What level 0 is at a hit, in place of its face's average; the shading normal in world space, or `normal`.
vec3 look_closely(const TracedLevel& level, const SurfacePoint& point, const InstanceRecord& instance,
                  const vec3& normal, Interaction& interaction, SurfaceParams& params) {
  const auto& close_up = static_cast<const CloseUp&>(*level.look);  // the runtime gives levels no other
  const auto [source, material] = close_up.sample(level.view, point);
  interaction.material = source.material;
  interaction.source_face = source.source_face;
  interaction.barycentric = source.barycentric;
  interaction.uv = source.uv;
  if (material) {
    params.diffuse = material->diffuse;
    params.specular = material->specular;
    params.transmission = material->transmission;
    params.roughness2 = std::pow(material->roughness, 4.0f);
    interaction.emission = material->emission;
  }
  return source.normal == vec3(0.0f) ? normal : glm::normalize(instance.normal_to_world(source.normal));
}

/// The distribution of a face's normals in world space, trace 1; none: its own alone.
std::optional<SymMat3> face_normals(const LevelView& view, uint32_t face, const InstanceRecord& instance) {
  if (view.face_sggx.empty()) return std::nullopt;
  return to_world(unpack(view.face_sggx[face]), ScaledInverse(instance));
}

template <typename T>
T blended(const T& a, const T& b, float t) {
  return a * (1 - t) + b * t;
}

SurfaceParams blended(const SurfaceParams& a, const SurfaceParams& b, float t) {
  SurfaceParams mixed;
  mixed.diffuse = blended(a.diffuse, b.diffuse, t);
  mixed.specular = blended(a.specular, b.specular, t);
  mixed.transmission = blended(a.transmission, b.transmission, t);
  mixed.roughness2 = blended(a.roughness2, b.roughness2, t);
  return mixed;
}

/// Per unit of the ray's parameter, at a collision: what the flight had of the volume that it met, and in a morph what
/// the other one adds there.
float attenuation(const HitLevels& levels, const InstanceRecord& instance, const HitRecord& hit, const vec3& position,
                  const vec3& direction) {
  if (!levels.morph) return hit.attenuation;
  const TracedLevel& other = hit.is_coarser ? levels.morph->fine() : levels.morph->coarse();
  const float share = hit.is_coarser ? 1 - hit.blend : hit.blend;
  return hit.attenuation +
         share * other.volume.attenuation_at(instance.point_to_local(position), instance.vector_to_local(direction));
}

/// How a face reflects at a hit.
struct FaceShading {
  SurfaceParams params;
  SheetShape sheet;  ///< of pieces
  float gap;
  SymMat3 pieces;  ///< whose projected areas squared, in world space, are these
};

/// With the geometric normal known; sets the shading normal and what the face emits.
FaceShading shade_surface(const HitLevels& levels, const InstanceRecord& instance, const HitRecord& hit,
                          const vec3& world_direction, Interaction& interaction) {
  const TracedLevel& level = *levels.level;
  const LevelView& view = level.view;
  const uint32_t quad = hit.element / 2, face = level.face_of(quad, hit.element % 2);
  SurfaceParams params = face_params(view, face);
  SheetShape sheet = sheet_shape(view, face);
  float gap = gap_of(view, face);
  interaction.emission = emission_at(view.face_emission, face);
  vec3 normal = interaction.geometric_normal;
  std::optional<SymMat3> normals = face_normals(view, face, instance);
  if (level.look) {
    const vec3 local = instance.vector_to_local(world_direction);
    const float width = hit.footprint * glm::length(local) / glm::length(world_direction);
    const vec2 barycentric(hit.barycentric[0], hit.barycentric[1]);
    normal = look_closely(level, {quad, face, barycentric, local, width}, instance, normal, interaction, params);
  }
  if (levels.morph && !hit.is_coarser) {
    const uint32_t target = levels.morph->coarse_face(face);
    const TracedLevel& coarse = levels.morph->coarse();
    if (target < coarse.face_count) {
      const auto of_target = face_normals(coarse.view, target, instance);
      normals = blended(normals.value_or(SymMat3::outer(normal)),
                        of_target.value_or(SymMat3::outer(interaction.geometric_normal)), hit.blend);
      params = blended(params, face_params(coarse.view, target), hit.blend);
      const SheetShape sheet_of_target = sheet_shape(coarse.view, target);
      if (sheet.is_sheet() && sheet_of_target.is_sheet()) {
        sheet = blended(sheet, sheet_of_target, hit.blend);
        gap = blended(gap, gap_of(coarse.view, target), hit.blend);
      }
      interaction.emission = blended(interaction.emission, emission_at(coarse.view.face_emission, target), hit.blend);
    }
  }
  if (normals) set_sggx(interaction.reflectance, *normals);
  if (sheet.is_sheet()) {  // what faces where is for its pieces to say
    interaction.shading_normal = interaction.geometric_normal;
    return {params, sheet, gap, normals.value_or(SymMat3::outer(normal))};
  }
  if (normals) {
    const MainNormal main = main_normal(*normals, normal);
    normal = main.normal;
    params.roughness2 = std::min(params.roughness2 + main.roughness2, 1.0f);
  }
  interaction.shading_normal = visible_normal(normal, interaction.geometric_normal, interaction.wo);
  return {params, {}, 0, {}};
}

FlakeParams flakes_of(const FaceShading& face) {
  FlakeParams flakes;
  flakes.sggx = face.pieces;
  flakes.diffuse = face.params.diffuse;
  flakes.specular = face.params.specular;
  flakes.transmission = face.params.transmission;
  flakes.roughness2 = face.params.roughness2;
  return flakes;
}

/// Light does not go through a surface because its two normals disagree about its sides.
bool is_on_one_side(const Interaction& interaction, const vec3& wi) {
  return glm::dot(wi, interaction.geometric_normal) * glm::dot(wi, interaction.shading_normal) >= 0.0f;
}

}  // namespace

Interaction make_interaction(const HitLevels& levels, const InstanceRecord& instance, const RTCRayHit& ray_hit,
                             const HitRecord& hit) {
  const LevelView& view = levels.level->view;
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
  interaction.uv = glm::vec2(NAN);

  if (hit.is_volume) {
    interaction.sigma_t = attenuation(levels, instance, hit, interaction.position, direction) / glm::length(direction);
  }
  if (hit.is_volume && view.header.medium == Medium::Fog) {
    interaction.kind = Interaction::Kind::Volume;
    const FogParams params = world_fog_params(view, instance, hit.element);
    interaction.albedo = cluster_albedo(params.albedo, params.self_shadowing);
    interaction.reflectance.fog = params.albedo;
    interaction.reflectance.anisotropy = params.anisotropy;
    interaction.reflectance.self_shadowing = params.self_shadowing;
    InteractionModel::put(interaction, InteractionModel(FogPhase(params, interaction.wo)));
    return interaction;
  }
  if (hit.is_volume) {
    interaction.kind = Interaction::Kind::Volume;
    const FlakeParams params = world_flake_params(view, instance, hit.element);
    set_reflectance(interaction.reflectance, params);
    set_sggx(interaction.reflectance, params.sggx);
    interaction.reflectance.self_shadowing = params.self_shadowing;
    interaction.albedo = layered_albedo(params.specular, params.diffuse + params.transmission);
    interaction.emission = emission_at(view.voxel_emission, hit.element);
    InteractionModel::put(interaction, InteractionModel(FlakePhase(params, interaction.wo)));
    return interaction;
  }
  interaction.kind = Interaction::Kind::Surface;
  const bool is_part = hit.placement != kNoPlacement;
  const InstanceRecord& of_surface = is_part ? placed(instance, view.placements[hit.placement]) : instance;
  const vec3 normal_local(hit.normal_local[0], hit.normal_local[1], hit.normal_local[2]);
  const vec3 normal = glm::normalize(of_surface.normal_to_world(glm::normalize(normal_local)));
  interaction.geometric_normal = glm::dot(normal, interaction.wo) < 0.0f ? -normal : normal;
  const FaceShading shading = shade_surface(levels, of_surface, hit, direction, interaction);
  if (is_part && interaction.source_face != kNoMaterial) {
    interaction.source_face += view.placements[hit.placement].source_face_offset;
  }
  const SurfaceParams& params = shading.params;
  set_reflectance(interaction.reflectance, params);
  interaction.albedo = layered_albedo(params.specular, params.diffuse + params.transmission);
  const float offset = ray_offset(instance, origin, interaction.position, view.header.bounds);
  if (shading.sheet.is_sheet()) {
    const SheetPhase phase(flakes_of(shading), shading.sheet, shading.gap, interaction.geometric_normal,
                           interaction.wo);
    InteractionModel::put(interaction, InteractionModel(phase, offset));
    return interaction;
  }
  InteractionModel::put(
      interaction,
      InteractionModel(SurfaceBsdf(params, interaction.shading_normal, interaction.wo),
                       HorizonLobe(params, interaction.shading_normal, interaction.geometric_normal), offset));
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
  if (model.has_phase()) return model.with_phase([&](const auto& phase) { return phase.sample(rng); });
  const HorizonLobe& horizon = model.horizon;
  if (!(horizon.chance > 0)) return model.surface.sample(rng);
  ScatterSample sample;
  if (rng.next() < horizon.chance) {
    const float side = rng.next(), u1 = rng.next(), u2 = rng.next();
    sample.wi = horizon.sample(side, u1, u2);
  } else {
    sample.wi = model.surface.sample_direction(rng);
    if (sample.wi == vec3(0.0f)) return {};
  }
  sample.pdf = pdf(sample.wi);
  sample.weight = sample.pdf > 0 ? eval(sample.wi, rng) / sample.pdf : vec3(0.0f);
  return sample;
}

glm::vec3 Interaction::eval(const glm::vec3& wi, Rng& rng) const {
  if (kind == Kind::None) return vec3(0.0f);
  const InteractionModel& model = InteractionModel::of(*this);
  if (model.has_phase()) return model.with_phase([&](const auto& phase) { return phase.eval(wi, rng); });
  const vec3 value = is_on_one_side(*this, wi) ? model.surface.eval(wi) : vec3(0.0f);
  return model.horizon.chance > 0 ? value + model.horizon.eval(wi) : value;
}

float Interaction::pdf(const glm::vec3& wi) const {
  if (kind == Kind::None) return 0.0f;
  const InteractionModel& model = InteractionModel::of(*this);
  if (model.has_phase()) return model.with_phase([&](const auto& phase) { return phase.pdf(wi); });
  const float chance = model.horizon.chance;
  const float density = (1 - chance) * model.surface.pdf(wi);
  return chance > 0 ? density + chance * model.horizon.pdf(wi) : density;
}

float Interaction::next_cone_spread(const ScatterSample& sample, float cone_spread) const {
  if (!(sample.pdf > 0.0f)) return cone_spread;
  const float lobe = 2.0f * std::sqrt(1.0f / (kPi * sample.pdf));
  return cone_spread + std::min(kConeShare * lobe, kWidestCone);
}

RayDifferential Interaction::next_differential(const ScatterSample& sample, const RayDifferential& incoming,
                                               float t) const {
  RayDifferential arrived =
      kind == Kind::Surface ? transferred(incoming, -wo, t, geometric_normal) : transferred(incoming, t);
  if (kind == Kind::Surface && glm::dot(sample.wi, geometric_normal) > 0.0f) {
    const vec3 half = sample.wi + wo;
    const float length = glm::length(half);
    if (length > 0.0f) arrived = reflected(arrived, -wo, half / length);
  }
  return widened(arrived, sample.wi, next_cone_spread(sample, 0.0f));
}

void Interaction::spawn(const ScatterSample& sample, float t, RayContext& context) const {
  if (context.has_differential) {
    context.set_differential(next_differential(sample, context.differential, t), sample.wi, context.footprint_axis);
  }
  context.cone_width += context.cone_spread * t;
  context.cone_spread = next_cone_spread(sample, context.cone_spread);
  context.set_origin(context.hit);
}

}  // namespace farfield
