// SPDX-License-Identifier: Apache-2.0
// A cage in OpenSubdiv's terms.
#pragma once

#include <opensubdiv/far/topologyRefiner.h>

#include <memory>

#include "import/subdivision_options.h"
#include "prefilter/cage.h"

namespace farfield {

/// How a cage is smoothed.
struct LimitRules {
  SubdivisionScheme scheme = SubdivisionScheme::CatmullClark;  ///< of Loop, all faces are triangles; None: they
                                                               ///< are triangles and quads and stay as they are
  CageBoundary boundary = CageBoundary::EdgeAndCorner;
  CageUv uv = CageUv::CornersPlus1;
  CageCreasing creasing = CageCreasing::Uniform;
};

/// Neighbourhoods, creases and seams; uv are channel 0, colours the next. The cage must outlive it.
std::unique_ptr<OpenSubdiv::Far::TopologyRefiner> make_refiner(const Cage& cage, const LimitRules& rules);

/// A cage of quads with the same limit surface: each face is cut once by Catmull and Clark's scheme. Then faces can be
/// tessellated more finely along one direction than along the other, as the triangles around a pole want to be.
Cage refine_to_quads(const Cage& cage, const LimitRules& rules);

}  // namespace farfield
