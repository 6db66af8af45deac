// SPDX-License-Identifier: Apache-2.0
// Resolution-based simplification of macrosurfaces with filtered materials (thesis 8.1 to 8.4).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "prefilter/surface.h"

namespace farfield {

/// Goes up when simplify() gives other results.
inline constexpr uint32_t kSimplifyVersion = 2;

/// What collapses.
enum class SimplifyMethod {
  Auto,   ///< as Loops in connected parts of well-structured quads, as Edges in the others
  Loops,  ///< face loops of quads, edges of the other faces: quads stay quads
  Edges,  ///< edges of all faces
};
const char* name_of(SimplifyMethod method);
Result<SimplifyMethod> parse_simplify_method(const std::string& name);  ///< auto, loops or edges

struct SimplifyOptions {
  float resolution = 0;  ///< r_k in scene units; collapsing stops at edges of about half of it. <= 0: nothing collapses
  SimplifyMethod method = SimplifyMethod::Auto;
  std::span<const uint8_t> is_pinned =
      {};  ///< per vertex: stays where it is, and all of it collapses as Edges. Empty: none
};

/// A simplified surface and where everything went; kMorphVoxelized and kMorphCollapsed are in cache/level.h.
struct SimplifyResult {
  Surface surface;
  std::vector<uint32_t> vertex_map;  ///< input vertex -> output vertex; kMorphVoxelized if no input face uses it
  std::vector<uint32_t> face_map;    ///< input face -> output face, or kMorphCollapsed
};

/// Collapses face loops or edges until faces are about half the resolution wide, and filters the materials around each
/// collapse so that their area-weighted mean stays (8.3.8). Output faces keep the order, the winding, the corner order
/// and the quad of the input faces that they come from (Edges: no quads); output vertices are those used by faces.
///
/// What stays: topology (link condition), so a manifold stays one; borders and non-manifold edges, which collapse only
/// along themselves; the orientation of every face; the area enclosed by a plane border; and the distance to the
/// input, up to a fraction of the resolution. A collapse that would break one of these is not made: simplification
/// never fails, it stops earlier; so it does once the job is cancelled. Deterministic for any thread count;
/// thread-safe.
SimplifyResult simplify(const Surface& macrosurface, const SimplifyOptions& options, const Job& job = {});

}  // namespace farfield
