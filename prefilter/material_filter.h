// SPDX-License-Identifier: Apache-2.0
// How the materials around a collapsing edge mix (thesis 8.3; docs/theory.md, section 6.1).
#pragma once

#include <span>

#include "prefilter/surface.h"

namespace farfield {

/// factor_a * a + factor_b * b in every channel.
FaceMaterial mix(const FaceMaterial& a, float factor_a, const FaceMaterial& b, float factor_b);

/// Filters the materials of the faces around one collapse in place. `area_before[i]` and `area_after[i]` are face i's
/// areas, 0 after for faces that collapse. The mean weighted by area after equals that weighted by area before; faces
/// whose share of the area does not grow keep their own. Does nothing where a mean is undefined (no area).
void filter_materials(std::span<const double> area_before, std::span<const double> area_after,
                      std::span<FaceMaterial> materials);

}  // namespace farfield
