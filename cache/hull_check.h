// SPDX-License-Identifier: Apache-2.0
// Whether a level lies in the convex hull that its manifest gives: instances are bounded by it, and what lies outside
// is cut off.
#pragma once

#include <span>

#include "base/vec.h"
#include "cache/level.h"

namespace farfield {

/// How far vertices and centres of occupied voxels reach out of the convex hull of these points, at most, along 64
/// directions all around; local units, <= 0 if nowhere. That finds whatever sticks out visibly. For the bounds' corners
/// alone (no points): minus infinity. About 10 ns a vertex.
float reach_out_of_hull(const LevelView& level, std::span<const vec3> hull);

/// What reach_out_of_hull() of a sound level may be: rounding, and what a hull of few planes leaves. bounds: of all
/// levels.
float hull_slack(const Box3& bounds);

}  // namespace farfield
