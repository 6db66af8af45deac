// SPDX-License-Identifier: Apache-2.0
// How much light the highlight of a rough surface returns, for models that neither lose nor invent any
// (docs/theory.md, section 5).
#pragma once

#include "base/vec.h"

namespace farfield {

/// What GGX facets with Smith's height-correlated masking return of light from one direction, after one reflection.
struct HighlightShare {
  float all;      ///< where every facet reflects all it gets; the rest is masked
  float grazing;  ///< where facets reflect (1 - cos)^5 of it
};

/// A dielectric's or a metal's highlight on a flat face. A value; any thread.
class Highlight {
 public:
  Highlight() = default;
  /// f0: albedo at normal incidence, clamped to [0, 1]. roughness2: alpha^2, clamped; NaN is 1. The first call ever
  /// computes a table (some 40 ms).
  Highlight(const vec3& f0, float roughness2);

  bool exists() const { return f90_ > 0; }
  float alpha() const { return alpha_; }
  /// Of one facet, cos in [0, 1].
  vec3 fresnel(float cos) const;
  /// From a table, absolute error below 0.004 (0.015 of what is nearly a mirror, within two degrees of grazing). cos:
  /// between direction and normal, clamped to [0, 1].
  HighlightShare share(float cos) const;
  /// Of light from there, all that comes back: directly, and over several facets.
  vec3 albedo(const HighlightShare& share) const {
    return glm::min(once(share) + multiple_ * (1 - share.all), vec3(1.0f));  // rounding may have it beyond
  }
  vec3 once(const HighlightShare& share) const { return f0_ * (share.all - share.grazing) + f90_ * share.grazing; }
  /// The mean of albedo() over light from everywhere, exactly that of the table.
  vec3 mean_albedo() const { return albedo(mean_); }
  /// Light over several facets: the lobe is multiple_lobe() (1 - all(wo)) (1 - all(wi)) / pi [Kulla and Conty 2017].
  vec3 multiple_lobe() const;

 private:
  vec3 f0_{0.0f};
  float f90_ = 0;
  float alpha_ = 1;
  HighlightShare mean_{1, 1};
  vec3 multiple_{0.0f};  ///< of what is masked, how much comes back
};

}  // namespace farfield
