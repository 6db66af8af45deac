// SPDX-License-Identifier: Apache-2.0
// Ways to place vertices, against each other (thesis fig. 8.4): quadrics, equal volume, closest points, equal area.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "prefilter/surface.h"

namespace farfield {

/// How far a simplified surface is from what it was made of.
struct SimplifierFigures {
  std::string name;
  uint64_t faces = 0;
  double farthest = 0, rms = 0;         ///< two-sided distance, in r_k
  double area_change = 0;               ///< as a part of the area before
  std::optional<double> volume_change;  ///< the same of the volume; nothing where the surface encloses none
};

/// "ours" (`simplified`, made of `before` at this resolution), what our edge collapse makes of it with vertices where
/// the volume stays ("equal volume") and where the closest points have them ("closest points", the thesis's), and what
/// meshoptimizer's quadrics make in as many faces as ours ("quadrics"), if has_quadrics(). Not empty surfaces.
std::vector<SimplifierFigures> compare_simplifiers(const Surface& before, const Surface& simplified, double resolution);

/// Whether this program was built with meshoptimizer.
bool has_quadrics();
/// What meshoptimizer's simplifier leaves of a surface that is not empty, in about so many faces: positions as they
/// were, no faces without area, no materials. Empty without has_quadrics().
Surface simplified_by_quadrics(const Surface& before, size_t faces);

}  // namespace farfield
