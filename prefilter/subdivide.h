// SPDX-License-Identifier: Apache-2.0
// Subdivision cages become faces near their limit surface, and displacement maps move these, before anything else
// looks at them (thesis 6.1.3, 6.1.5).
#pragma once

#include <string>

#include "base/job.h"
#include "base/result.h"
#include "import/source_mesh.h"

namespace farfield {

/// With a scheme, `mesh` is taken as a cage: the result has its limit surface as quads and triangles that lie within
/// options.error of it (an estimate), with limit normals and smoothed texture coordinates and colours, and the cage's
/// materials. Edges are cut alike by all their faces, so what is closed stays closed. face_number of the result are the
/// cage's faces. Faces with a displacement map (SourceMesh::heights) are cut until they lie within options.error of the
/// displaced surface, too, and moved along the limit normals; without a scheme along those of the mesh's corners, where
/// they have none of the faces, and faces without a map stay as they are. Without scheme and maps the mesh comes back
/// as it is, with a warning if its tags go unheard. What is mended
/// in a cage is a warning each. The same for any number of threads. `name` is for messages. Errors: InvalidArgument
/// (options; Loop of other faces than triangles), BadFile, Unsupported (a cage of more than options.most_faces; those
/// of make_cage; heights far beyond the mesh), Cancelled; with the mesh's warnings. [Catmull and Clark 1978] [Loop
/// 1987]
Result<SourceMesh> subdivide(SourceMesh mesh, const SubdivisionOptions& options, const std::string& name,
                             const Job& job = {});

}  // namespace farfield
