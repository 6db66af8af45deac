// SPDX-License-Identifier: Apache-2.0
// Where a surface is so smooth and so far from its borders that macrosurface analysis has nothing to find out.
#pragma once

#include <cstdint>
#include <vector>

#include "base/job.h"
#include "prefilter/edge_table.h"
#include "prefilter/surface.h"
#include "prefilter/surface_patches.h"

namespace farfield {

/// Per face: 1 where within `resolution` (> 0) of its evaluation point what is connected to it has no border and no
/// edge of three faces, and all its normals lie within 41 degrees of one axis. Such a surface is a height field of
/// slopes below 1 over the plane across the axis: on it the distance from the point only grows on the way out, so that
/// it leaves the ball in one curve (thesis 7.1.2). 0 says nothing; so do faces that are large against the resolution,
/// which are as soon explored. blocks: of the surface, small against the resolution. Winding does not matter.
/// Deterministic for any thread count; thread-safe. Once the job is cancelled the answers mean nothing.
std::vector<uint8_t> find_gentle_faces(const Surface& surface, const EdgeTable& edges, const Blocks& blocks,
                                       double resolution, const Job& job);

}  // namespace farfield
