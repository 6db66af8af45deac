// SPDX-License-Identifier: Apache-2.0
// Into how many parts a displaced face is cut so that what lies between its vertices is not missed.
#pragma once

#include <array>

#include "prefilter/face_heights.h"

namespace farfield {

/// Rates along u and v (of triangles twice the same) of at least `least`, at which heights between neighbouring
/// vertices, `scale` times what the map says, lie within `error` of the chord, and within less where parts are about as
/// short as the detail, so that slopes show; no more than detail.most.
std::array<int, 2> rates_of_heights(const SourceHeights& heights, const FaceLimit& limit, const HeightDetail& detail,
                                    double scale, double error, std::array<int, 2> least);

}  // namespace farfield
