// SPDX-License-Identifier: Apache-2.0
// One surface around a wall that is made of pieces, which looks as they do (docs/decisions/0014).
#pragma once

#include "base/result.h"
#include "prefilter/surface.h"

namespace farfield {

/// A surface around all triangles of `wall`, front and back: without the gaps narrower than a quarter of `resolution`
/// (scene units, > 0), its vertices on the triangles. Each face has the materials that rays from outside see there, and
/// the share of light that does not stay between the pieces; of walls that rays get through, also the share that does
/// (gap). Empty if no ray hits. Deterministic for any thread count. Errors: those of OpacityScene::build().
Result<Surface> wrap_wall(const Surface& wall, double resolution);

}  // namespace farfield
