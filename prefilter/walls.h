// SPDX-License-Identifier: Apache-2.0
// Walls made of pieces: planks, tiles, shingles, whose gaps are small against a resolution (docs/decisions/0014).
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "prefilter/surface.h"

namespace farfield {

enum class WallKind : uint8_t {
  None,
  Closed,    ///< with gaps that are small against the pieces
  HalfOpen,  ///< planks apart, slats, wires: a sheet that lets many rays through
};

struct Walls {
  std::vector<WallKind> kinds;   ///< per face of the geometry
  std::vector<uint8_t> is_core;  ///< per face of the macrosurface
};

/// Which faces are part of a wall at `resolution` (scene units, > 0), beside the macrosurface of that resolution.
///
/// A place is wall if all geometry within about 1.5 resolutions of it lies in a layer that is thin against the
/// resolution, covers most of a disc there when looked at along the layer's normal, mostly with faces that lie in the
/// layer's plane, and lets no light through. So foliage is none: its leaves lie at all angles, or leave holes. What
/// covers less is a wall, half open, if such places go on into one another for some six resolutions both ways and are
/// all open alike, which leaves, scales and feathers are not. Faces of whose area most lies close to such places are of
/// the wall.
///
/// Where a surface runs inside the layer, as masonry does between bricks, the wall is closed, whatever its pieces leave
/// open, and that surface is its core: a sheet between the pieces would be behind it.
///
/// Deterministic for any thread count. Errors: those of OpacityScene::build().
Result<Walls> find_walls(const Surface& geometry, const Surface& macrosurface, double resolution);

/// Per face of `geometry`: 1 where most of its area is within about `distance` (> 0) of faces of `surface` that are
/// marked in `is_marked`. Deterministic for any thread count.
std::vector<uint8_t> find_near(const Surface& geometry, const Surface& surface, const std::vector<uint8_t>& is_marked,
                               double distance);

}  // namespace farfield
