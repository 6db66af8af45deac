// SPDX-License-Identifier: Apache-2.0
// What a host tells Farfield about a ray, and what it learns about a hit.
#pragma once

#include <cstdint>
#include <cstring>

#include "farfield/embree.h"
#include "farfield/ray_differential.h"

namespace farfield {

inline constexpr uint32_t kNoInstance = 0xffffffffu;
inline constexpr uint32_t kNoPlacement = 0xffffffffu;

/// What Farfield remembers of the nearest hit on its geometry, enough to rebuild the interaction. Opaque to hosts.
struct HitRecord {
  uint32_t instance = kNoInstance;
  uint32_t element = 0;    ///< 2 * quad + side of its diagonal, or payload index of the voxel
  uint8_t level_slot = 0;  ///< index into the asset's stored levels
  bool is_volume = false;
  bool is_coarser = false;            ///< of a morph: `element` is of the level after level_slot
  float blend = 0;                    ///< in (0, 1): of a morph from level_slot to the next; 0: of that level alone
  float lambda = 0;                   ///< continuous level that was asked for
  float footprint = 0;                ///< world width of what the ray stands for there
  float normal_local[3] = {0, 0, 0};  ///< geometric normal, unnormalised, in the instance's or part's space; surfaces
  float barycentric[2] = {0, 0};      ///< weights of the face's second and third corner; surfaces only
  float attenuation = 0;              ///< of the medium that was met there, per unit of tfar; volumes only
  uint32_t placement = kNoPlacement;  ///< of a part that stands in several places of its asset: which
};

namespace detail {
/// Bits of RTCIntersectContext::flags that Embree does not look at: by them Farfield knows what it may cast the context
/// to. Not an enumerator, so copied as bytes.
inline constexpr uint32_t kRayContextMark = 0x46460000u;
inline constexpr uint32_t kRayContextsMark = 0x46470000u;
inline void mark(RTCIntersectContext& context, uint32_t mark, bool is_coherent = false) {
  static_assert(sizeof context.flags == sizeof mark, "Embree's flags are an int");
  if (is_coherent) mark |= uint32_t{RTC_INTERSECT_CONTEXT_FLAG_COHERENT};
  std::memcpy(&context.flags, &mark, sizeof mark);
}
}  // namespace detail

/// The context to pass to rtcIntersect1 and rtcOccluded1 for rays that may meet Farfield geometry:
/// `rtcIntersect1(scene, &ray_context.embree, &ray_hit)`. Fill it anew for every ray. Leave embree.flags alone
/// but for set_coherent(); embree.filter is yours.
///
/// A query with another context is answered too: as that of a ray without width, whose random numbers come from its
/// origin and direction, and of which nothing but distance, normal and ids is known afterwards. For packets and streams
/// see RayContexts; with a RayContext all their lanes share it, but only distances, normals and ids come back.
struct RayContext {
  RTCIntersectContext embree;  ///< first member; initialised by the constructor

  // In: the cone of the ray [Amanatides 1984]. Its diameter at ray parameter t is cone_width + cone_spread * t.
  float cone_width = 0;   ///< world units at the ray's origin, >= 0
  float cone_spread = 0;  ///< world units per unit of t, >= 0
  // In: randomness. Same values give the same answer.
  uint32_t path_seed = 0;  ///< constant along a path: decides which of two blended levels the path sees
  uint32_t ray_seed = 0;   ///< different for every ray: free flights in volumes
  // In: where the ray starts. A ray that leaves a Farfield hit keeps that hit's level on the same instance.
  uint32_t origin_instance = kNoInstance;
  uint8_t origin_level_slot = 0;
  float origin_blend = 0;
  // In, in place of the cone: see set_differential().
  bool has_differential = false;
  FootprintAxis footprint_axis = FootprintAxis::Longer;
  RayDifferential differential;
  FootprintGrowth footprint_growth;

  // In and out of occlusion queries, unless a filter of the host's is asked. Negative: volumes stop the ray with the
  // probability that they stop light. Else the ray passes volumes, and this is multiplied by the share of light that
  // they let through, without noise and for about the cost of a few such rays. Set it to 1 before each query; what the
  // query calls occluded, a surface has stopped.
  float transmittance = -1;

  // Out: valid after rtcIntersect1 if and only if ray_hit.hit.geomID is Runtime::geometry_id().
  HitRecord hit;

  RayContext() {
    rtcInitIntersectContext(&embree);
    detail::mark(embree, detail::kRayContextMark);
  }
  /// For packets and streams: Embree's RTC_INTERSECT_CONTEXT_FLAG_COHERENT, or _INCOHERENT, the default.
  void set_coherent(bool is_coherent) { detail::mark(embree, detail::kRayContextMark, is_coherent); }
  /// Gives the ray a differential in place of its cone; the axis is what asks for levels. The ray's direction is a unit
  /// vector then.
  void set_differential(const RayDifferential& of_ray, const glm::vec3& unit_direction,
                        FootprintAxis axis = FootprintAxis::Longer) {
    has_differential = true;
    footprint_axis = axis;
    differential = of_ray;
    footprint_growth = FootprintGrowth(of_ray, unit_direction);
  }
  /// How wide what the ray stands for is at parameter t; world units.
  float width_at(float t) const {
    return has_differential ? width_of(footprint_growth.at(t), footprint_axis) : cone_width + cone_spread * t;
  }
  /// Says that the ray starts at `from`, a hit on Farfield geometry.
  void set_origin(const HitRecord& from) {
    origin_instance = from.instance;
    origin_level_slot = from.level_slot;
    origin_blend = from.blend;
  }
};

/// The context to pass for packets and streams, with one RayContext for each ray: rtcIntersect4, 8, 16, 1M, Np and the
/// occlusion queries. RTCRay::id says which: the ray's index in `rays`, whatever order Embree works in. After the query
/// each has its own hit; Runtime::interaction() takes it with the ray's RTCRayHit as for a single ray. A ray whose id
/// is not below `count` is treated as with another context (see RayContext).
struct RayContexts {
  RTCIntersectContext embree;  ///< first member; initialised by the constructor
  RayContext* rays;
  uint32_t count;

  RayContexts(RayContext* of_rays, uint32_t ray_count) : rays(of_rays), count(ray_count) {
    rtcInitIntersectContext(&embree);
    detail::mark(embree, detail::kRayContextsMark);
  }
  void set_coherent(bool is_coherent) { detail::mark(embree, detail::kRayContextsMark, is_coherent); }
};

}  // namespace farfield
