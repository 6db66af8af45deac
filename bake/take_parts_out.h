// SPDX-License-Identifier: Apache-2.0
// A source in which something stands in several places, with that only once: what a level 0 with parts is made of
// (docs/decisions/0039-parts-of-level-0.md).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "cache/level.h"
#include "prefilter/source_surface.h"

namespace farfield {

struct PartedSource {
  SourceSurface surface;       ///< what stands once, then each part in a space of its own; they share no vertices
  std::vector<uint32_t> part;  ///< per triangle, ascending: 0 for what stands once, p + 1 for part p
  std::vector<PartPlacement> places;  ///< of the parts, part by part
};

/// Parts are what a source's placements repeat, if that takes a quarter: many places of many triangles.
/// Nothing if no part is left, or where a host's function colours faces by where they are. The triangles of all places
/// of a part are the same but for the transform; a mesh whose places differ (faces of one have collapsed) stays flat.
std::optional<PartedSource> take_parts_out(const SourceSurface& source);

}  // namespace farfield
