// SPDX-License-Identifier: Apache-2.0
// What a host tells Farfield about a ray, and what it learns about a hit.
#pragma once

#include <cstdint>

#include "farfield/embree.h"

namespace farfield {

inline constexpr uint32_t kNoInstance = 0xffffffffu;

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
  float normal_local[3] = {0, 0, 0};  ///< geometric normal, instance space, unnormalised; surfaces only
  float barycentric[2] = {0, 0};      ///< weights of the face's second and third corner; surfaces only
};

/// The context to pass to rtcIntersect1 and rtcOccluded1 for rays that may meet Farfield geometry:
/// `rtcIntersect1(scene, &ray_context.embree, &ray_hit)`. Farfield casts the context pointer back, so every single-ray
/// query on a scene with Farfield geometry must pass one of these. Fill it anew for every ray. For packets and streams
/// all lanes share one, and only distances and occlusion come back.
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

  // Out: valid after rtcIntersect1 if and only if ray_hit.hit.geomID is Runtime::geometry_id().
  HitRecord hit;

  RayContext() { rtcInitIntersectContext(&embree); }
  /// Says that the ray starts at `from`, a hit on Farfield geometry.
  void set_origin(const HitRecord& from) {
    origin_instance = from.instance;
    origin_level_slot = from.level_slot;
    origin_blend = from.blend;
  }
};

}  // namespace farfield
