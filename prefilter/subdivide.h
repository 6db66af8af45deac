// SPDX-License-Identifier: Apache-2.0
// Subdivision cages become faces near their limit surface, before anything else looks at them (thesis 6.1.3).
#pragma once

#include <string>

#include "base/job.h"
#include "base/result.h"
#include "import/source_mesh.h"

namespace farfield {

/// With a scheme, `mesh` is taken as a cage: the result has its limit surface as quads and triangles that lie within
/// options.error of it (an estimate), with limit normals and smoothed texture coordinates and colours, and the cage's
/// materials. Edges are cut alike by all their faces, so what is closed stays closed. face_number of the result are the
/// cage's faces. Without a scheme the mesh comes back as it is, with a warning if its tags go unheard. What is mended
/// in a cage is a warning each. The same for any number of threads. `name` is for messages. Errors: InvalidArgument
/// (options; Loop of other faces than triangles), BadFile, Unsupported (a cage of more than options.most_faces; those
/// of make_cage), Cancelled; with the mesh's warnings. [Catmull and Clark 1978] [Loop 1987]
Result<SourceMesh> subdivide(SourceMesh mesh, const SubdivisionOptions& options, const std::string& name,
                             const Job& job = {});

}  // namespace farfield
