// SPDX-License-Identifier: Apache-2.0
// Walls close behind each other (hull and lining, skin and cloth) are simplified each on its own, by more than what is
// between them: the inner would come through the outer (thesis 10.3). What crosses is moved back.
#pragma once

#include <cstdint>
#include <span>

#include "base/result.h"
#include "prefilter/simplify.h"
#include "prefilter/surface.h"

namespace farfield {

/// What keep_apart() found and did.
struct ApartReport {
  uint64_t walls = 0;     ///< vertices with another wall close before or behind them
  uint64_t moved = 0;     ///< vertices that were moved
  uint64_t crossing = 0;  ///< vertices of walls that still are on the wrong side, or touch
};

/// Moves vertices of `simplified` so that connected parts which ran side by side in `macrosurface`, no further apart
/// than half the resolution, stay on their sides of each other. Of two such parts the one moves that gets smaller by it
/// (the inner of two curved walls), so that silhouettes stay; and no vertex by more than a quarter of the resolution,
/// so that some may still cross. Parts that touch or cross in the macrosurface may do so afterwards, and where parts
/// are only near each other over less than the square of twice the resolution, nothing moves. Faces, maps and materials
/// stay. Deterministic for any thread count. Errors: those of RayScene::build().
/// is_pinned: per vertex of `simplified`, those that stay; empty: none.
Result<ApartReport> keep_apart(const Surface& macrosurface, float resolution, SimplifyResult& simplified,
                               std::span<const uint8_t> is_pinned = {});

}  // namespace farfield
