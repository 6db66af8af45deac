// SPDX-License-Identifier: Apache-2.0
// A mesh whose faces are parts of different subdivision cages, taken apart and put together again.
#pragma once

#include "import/source_mesh.h"

namespace farfield {

/// The faces of one scheme, those that say none counting as of `usual`, with their own points and tags. face_number are
/// those of `mesh`. Materials, heights and functions are shared; warnings, files and hash stay with `mesh`.
SourceMesh take_scheme(const SourceMesh& mesh, SubdivisionScheme scheme, SubdivisionScheme usual);

/// Appends the faces and warnings of `part`; what its corners lack is filled up (uv with NaN, colours white).
void append_part(const SourceMesh& part, SourceMesh& out);

}  // namespace farfield
