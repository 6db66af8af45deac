// SPDX-License-Identifier: Apache-2.0
// Macrosurface analysis: which faces belong to connected surfaces that are large against a resolution (thesis ch. 7).
#pragma once

#include <cstdint>
#include <vector>

#include "base/job.h"
#include "prefilter/surface.h"

namespace farfield {

/// Per face: 1 where it belongs to a macrosurface at `resolution` (scene units), 0 where it is sub-resolution geometry.
///
/// A face is macrosurface if the part of the surface that is connected to its middle inside the ball of radius
/// `resolution` around it leaves the ball in one connected curve (7.1.2). Then connected pieces that fit into such a
/// ball become sub-resolution (7.2.2), and sub-resolution islands that fit into one and are mostly surrounded by
/// macrosurface join it (7.3).
///
/// Winding does not matter. At an edge with more than two faces all of them are connected; faces that share only a
/// vertex are not. Where faces are much smaller than the resolution, one answer serves a patch of radius resolution /
/// 8, so that the work per face stays bounded. A resolution that is not positive makes everything macrosurface.
/// Deterministic for any thread count; thread-safe. Once the job is cancelled the answers mean nothing.
std::vector<uint8_t> classify_macrosurface(const Surface& surface, float resolution, const Job& job = {});

}  // namespace farfield
