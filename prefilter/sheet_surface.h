// SPDX-License-Identifier: Apache-2.0
// One surface in the place of a half-open wall: planks apart, slats, wires (docs/decisions/0031).
#pragma once

#include "base/result.h"
#include "prefilter/surface.h"

namespace farfield {

/// The middle of the pieces' layer as one sheet (make_sheet_mesh). Each face has the materials that rays see there from
/// both sides, the light that the pieces keep between them taken off, the share of rays along its normal that pass, and
/// how that changes with the direction (FaceMaterial::sheet). Empty if no ray hits. Deterministic for any thread count.
/// Errors: those of OpacityScene::build().
Result<Surface> lay_sheet(const Surface& pieces, double resolution);

}  // namespace farfield
