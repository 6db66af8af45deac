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
#include "scattering/sheet_phase.h"
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
    SurfaceBsdf surface;
    SheetPhase sheet;
    FlakePhase flakes;
    FogPhase fog;
  };
  enum class Of : uint8_t { Surface, Sheet, Flakes, Fog };  ///< the first two are Kind::Surface
  Of of_what;
  HorizonLobe horizon;  ///< of a surface
  float offset = 0;     ///< how far off the surface rays start, world units

  InteractionModel(const SurfaceBsdf& bsdf, const HorizonLobe& lobe, float ray_offset)
      : surface(bsdf), of_what(Of::Surface), horizon(lobe), offset(ray_offset) {}
  InteractionModel(const SheetPhase& phase, float ray_offset) : sheet(phase), of_what(Of::Sheet), offset(ray_offset) {}
  explicit InteractionModel(const FlakePhase& phase) : flakes(phase), of_what(Of::Flakes) {}
  explicit InteractionModel(const FogPhase& phase) : fog(phase), of_what(Of::Fog) {}

  bool has_phase() const { return of_what != Of::Surface; }
  /// Where it has one: use(its phase function).
  template <typename Use>
  auto with_phase(const Use& use) const {
    if (of_what == Of::Sheet) return use(sheet);
    return of_what == Of::Fog ? use(fog) : use(flakes);
  }

  static const InteractionModel& of(const Interaction& interaction);
  static void put(Interaction& interaction, const InteractionModel& model);
};

}  // namespace detail
}  // namespace farfield
