// SPDX-License-Identifier: Apache-2.0
// Light at a sheet with gaps (scattering/sheet.h): it meets fronts, sides and round pieces, each as many as rays from
// wo see, which scatter as flakes do (scattering/flake_phase.h): sides also from one side of the sheet to the other.
//
// Between square pieces it is dark: down to which depth wo sees into a gap, and down to which light gets, follows from
// what their sides hide. Of the light that meets other pieces there, some comes back from these, coloured again.
#pragma once

#include <array>

#include "base/random.h"
#include "base/vec.h"
#include "farfield/scatter_sample.h"
#include "scattering/flake_phase.h"
#include "scattering/sheet.h"

namespace farfield {

/// A sheet seen from wo. Directions are unit, away from the point. Immutable; any thread. No allocation.
class SheetPhase {
 public:
  /// flakes: the pieces in the space of the directions; gap: the share of rays along n that pass; n: the sheet's unit
  /// normal. shape.is_sheet().
  SheetPhase(const FlakeParams& flakes, const SheetShape& shape, float gap, const vec3& n, const vec3& wo);
  /// As FlakeModel's, also as to what is exact.
  vec3 eval(const vec3& wi, Rng& rng) const;
  float pdf(const vec3& wi) const;
  ScatterSample sample(Rng& rng) const;

 private:
  enum Part { kFront, kSides, kRound, kParts };

  Part choose(Rng& rng) const;
  FlakePhase part(Part part) const;
  /// What of its light gets out towards wi.
  vec3 gain(Part part, const vec3& wi) const;
  float depth_seen(float sides) const;
  vec3 with_returned(float open) const;

  FlakeParams flakes_;
  vec3 n_, wo_;
  std::array<float, kParts> share_;  ///< of what wo sees; the sum is 1
  float sides_;                      ///< towards wo
  float caught_, gap_to_front_;
  vec3 returned_;  ///< of the light that meets other pieces: what comes back from these
};

}  // namespace farfield
