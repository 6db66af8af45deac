// SPDX-License-Identifier: Apache-2.0
// What a ray costs in a level, counted instead of timed: the same on every machine, for any number of threads.
#pragma once

#include "cache/level.h"

namespace farfield {

/// How much a mean ray looks at.
struct RayWork {
  double boxes = 0;       ///< of a binary BVH over the surface's quads
  double quads = 0;       ///< tested
  double bricks = 0;      ///< of the volume's table, empty ones included
  double voxels = 0;      ///< crossed in bricks that are not faint
  double collisions = 0;  ///< tentative ones: payload is fetched
};

/// Work of a fixed set of rays, each weighed by how many there are: half come from all around through the level's
/// bounds, half go on from where those were stopped, in random directions. Deterministic; builds a BVH of its own.
RayWork count_ray_work(const LevelView& level);

/// The work as one number, about nanoseconds per ray on the machine where level_bench was run (docs/results/speed.md).
double ray_cost(const RayWork& work);
inline double ray_cost(const LevelView& level) { return ray_cost(count_ray_work(level)); }

}  // namespace farfield
