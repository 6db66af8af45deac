// SPDX-License-Identifier: Apache-2.0
// Vertices move by the heights of the faces around them [Cook 1984]; normals follow.
#pragma once

#include <vector>

#include "import/source_mesh.h"

namespace farfield {

/// Moves each position so that it lies `corner_height` (one per corner) above the faces of all its corners, along their
/// normals: where these agree along the normal, by the mean of the heights; at sharp edges where the raised faces
/// meet, so that a box raised by one height is a larger box. Edges sharper than 143 degrees and seams along which
/// heights differ on one smooth surface get means. A position with several corners moves as one: nothing cracks.
/// corner_normal must be unit, or 0 where there is none (such a corner moves nothing); they become those of the moved
/// faces, smooth and sharp where they were. The same for any number of threads.
void displace(SourceMesh& mesh, const std::vector<float>& corner_height);

}  // namespace farfield
