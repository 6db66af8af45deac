// SPDX-License-Identifier: Apache-2.0
// What an Interaction holds beside its public fields: the scattering model in world space.
#pragma once

#include "bvh/instance_geometry.h"
#include "bvh/traced_asset.h"
#include "bvh/traced_morph.h"
#include "farfield/interaction.h"
#include "scattering/flake_phase.h"
#include "scattering/fog_phase.h"
#include "scattering/horizon_lobe.h"
#include "scattering/surface_bsdf.h"

namespace farfield {

/// What a hit is on.
struct HitLevels {
  const TracedLevel* level = nullptr;  ///< the one whose element was hit
  const TracedMorph* morph = nullptr;  ///< of which it is one of the two; null: the level alone
};

/// Whether the level has what the record says was hit.
bool is_hit_of(const TracedLevel& level, const HitRecord& hit);

/// Rebuilds the interaction of a hit on a level (not null) of `instance`; is_hit_of(level, hit). ray_hit: as
/// rtcIntersect1 left it. Pure.
Interaction make_interaction(const HitLevels& levels, const InstanceRecord& instance, const RTCRayHit& ray_hit,
                             const HitRecord& hit);

namespace detail {

/// Lies in Interaction::model_. Trivially copyable, as interactions are copied byte by byte.
struct InteractionModel {
  union {
    SurfaceBsdf surface;  ///< Kind::Surface
    FlakePhase flakes;    ///< Kind::Volume, of flakes
    FogPhase fog;         ///< Kind::Volume, of fog
  };
  HorizonLobe horizon;  ///< Kind::Surface
  bool is_fog = false;  ///< which of the two, in volumes
  float offset = 0;     ///< how far off the surface rays start, world units

  InteractionModel(const SurfaceBsdf& bsdf, const HorizonLobe& lobe, float ray_offset)
      : surface(bsdf), horizon(lobe), offset(ray_offset) {}
  explicit InteractionModel(const FlakePhase& phase) : flakes(phase) {}
  explicit InteractionModel(const FogPhase& phase) : fog(phase), is_fog(true) {}

  /// Of Kind::Volume: use(its phase function).
  template <typename Use>
  auto with_phase(const Use& use) const {
    return is_fog ? use(fog) : use(flakes);
  }

  static const InteractionModel& of(const Interaction& interaction);
  static void put(Interaction& interaction, const InteractionModel& model);
};

}  // namespace detail
}  // namespace farfield
