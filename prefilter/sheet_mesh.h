// SPDX-License-Identifier: Apache-2.0
// The middle of a thin layer of pieces as a mesh.
#pragma once

#include "prefilter/surface.h"

namespace farfield {

/// Triangles without materials, with edges of about half of `resolution` (scene units, > 0), through the middle of the
/// pieces and as far as these reach: gaps of up to a resolution are closed. Where pieces lie in no layer there are
/// none. Deterministic for any thread count.
Surface make_sheet_mesh(const Surface& pieces, double resolution);

}  // namespace farfield
