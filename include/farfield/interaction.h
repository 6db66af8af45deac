// SPDX-License-Identifier: Apache-2.0
// A hit on Farfield geometry, ready to be shaded.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "farfield/export.h"
#include "farfield/random.h"
#include "farfield/ray.h"
#include "farfield/scatter_sample.h"

namespace farfield {

namespace detail {
struct InteractionModel;
}

/// No such material or face, or not known.
inline constexpr uint32_t kNoMaterial = 0xffffffffu;

/// What light meets at a point, as data: for hosts that shade by themselves (spectral ones), and for AOVs. Linear RGB
/// in [0, 1]. sample() and eval() know more: hot spots, open sides, self-shadowing's colour.
struct Reflectance {
  glm::vec3 diffuse{0.0f};       ///< of the light that the highlight leaves, to wo's side
  glm::vec3 specular{0.0f};      ///< F0 of a GGX highlight; 0: there is none
  glm::vec3 transmission{0.0f};  ///< as diffuse, to the other side
  float roughness = 1;           ///< of the highlight, as glTF has it: its square is GGX's alpha. With the spread of
                                 ///< normals at prefiltered faces
  /// SGGX matrix xx, yy, zz, xy, xz, yz of the flakes in a volume, or of the normals of a prefiltered face; world
  /// space, trace 1. 0 where a face has but one normal.
  float sggx[6] = {};
  float self_shadowing = 1;  ///< volumes: the share of the light that flakes send on which leaves unmet; 1: all
  glm::vec3 fog{0.0f};   ///< single-scattering albedo of fog, which has nothing of the above but sggx (0: isotropic)
                         ///< and self_shadowing; 0 for all else
  float anisotropy = 0;  ///< of fog: mean cosine of scattering, above 0 forwards
};

/// Where a ray met an instance and how light scatters there. A value that refers to the Runtime: use it before the next
/// plan_frame(). All directions are unit vectors in world space that point away from the point. Safe from any thread.
class FARFIELD_API Interaction {
 public:
  enum class Kind : uint8_t {
    None,  ///< the ray met nothing of ours, or the hit is older than the plan: black, samples have weight 0
    Surface,
    Volume,
  };

  Kind kind = Kind::None;
  glm::vec3 position{0.0f};          ///< world
  glm::vec3 wo{0.0f};                ///< where the ray came from
  glm::vec3 geometric_normal{0.0f};  ///< unit, on wo's side; zero in volumes
  glm::vec3 shading_normal{0.0f};    ///< unit, what light sees: smooth, normal-mapped; on wo's side; zero in volumes
  float footprint = 0;               ///< world width of what the ray stands for here
  uint32_t instance = kNoInstance;   ///< InstanceId of the hit
  uint32_t level = 0;                ///< k of the level that was hit
  float lambda = 0;                  ///< continuous level that the ray asked for
  glm::vec3 albedo{0.0f};            ///< of highlight and base together, for AOVs and denoisers
  Reflectance reflectance;           ///< what albedo is made of
  glm::vec3 emission{0.0f};          ///< radiance that leaves the point along wo by itself
  /// Volumes: extinction coefficient along the ray, 1 / world unit, with which free flights come to collisions here:
  /// density times projected area; in a blend that morphs, of both levels. Instances that overlap count for
  /// themselves. 0 on surfaces.
  float sigma_t = 0;

  // For a host that shades level 0 with its own materials; at coarser levels unknown: prefiltered faces have none.
  uint32_t material = kNoMaterial;     ///< id of the source's material; its name: Runtime::material_name()
  uint32_t source_face = kNoMaterial;  ///< number of the source's face; kNoMaterial where the level does not keep it
  glm::vec2 barycentric{0.0f};  ///< weights of the second and third corner of the source's triangle; of a part of
                                ///< a polygon where the source's face is no triangle
  glm::vec2 uv{0.0f};           ///< texture coordinates, v points down the image; NaN where there are none

  /// Origin for a ray that leaves in direction wi: offset to wi's side of a surface, the point itself in a volume. The
  /// offset is a few roundings of all coordinates that went into the hit (1e-6 of them), so that the ray, with tnear 0,
  /// does not meet the same face again; at 1e7 units from the world's origin that is about 30 units.
  glm::vec3 ray_origin(const glm::vec3& wi) const;
  /// Draws wi. The number of values taken from rng varies.
  ScatterSample sample(Rng& rng) const;
  /// Surfaces: BRDF (and transmission) times |cos| to the shading normal, for directions that are on the same side of
  /// both normals; the diffuse light that the others would get goes out around the geometric normal, so that white
  /// stays white. Volumes: albedo times phase function. Linear RGB per steradian. For diffuse microfacets an
  /// unbiased one-sample estimate: rng supplies the sample.
  glm::vec3 eval(const glm::vec3& wi, Rng& rng) const;
  /// For multiple importance sampling, per steradian. Surfaces: the density with which sample() draws wi. Volumes: a
  /// normalised density close to that, which has no closed form; estimates stay unbiased with ScatterSample::weight.
  float pdf(const glm::vec3& wi) const;
  /// Diameter spread to give the next ray's cone, by how wide the lobe that was sampled is: the incoming spread plus an
  /// eighth of the lobe's, 2 sqrt(1 / (pi pdf)), at most 1. About 0.25 after a diffuse event, 0.5 in isotropic volumes,
  /// nothing at mirrors.
  float next_cone_spread(const ScatterSample& sample, float cone_spread) const;
  /// The differential of the next ray: carried to the hit, t along the ray that came (unit direction), mirrored about
  /// the half vector or, through a surface or a flake, going straight on, and widened as cones are.
  RayDifferential next_differential(const ScatterSample& sample, const RayDifferential& incoming, float t) const;
  /// Makes the context that of the ray from ray_origin(sample.wi) towards sample.wi: where it starts, the level that it
  /// keeps there, its cone or differential. context: as the query left it, t: tfar of that ray. The host still
  /// gives it a new ray_seed.
  void spawn(const ScatterSample& sample, float t, RayContext& context) const;

 private:
  friend struct detail::InteractionModel;
  alignas(16) unsigned char model_[256];  ///< the scattering model in world space
};

}  // namespace farfield
