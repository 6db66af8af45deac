// SPDX-License-Identifier: Apache-2.0
// What level 0 has beyond other levels: all that close-ups and hosts' materials need of the source.
#pragma once

#include "bake/pack_level.h"
#include "cache/level.h"
#include "prefilter/source_surface.h"

namespace farfield {

/// Adds to a packed level 0 with the surface `ordered`, reorder(average_faces(source), order): materials and numbers of
/// faces, and at their corners shading normals, texture coordinates and vertex colours. Each only where something
/// depends on it: coordinates where there are textures or a host's function, colours where they vary inside faces or
/// textures multiply them, numbers where there are coordinates, colours or several materials. `source.triangles[i]` has
/// become the face order.face_number[i], its corners perhaps rotated.
void pack_source(const SourceSurface& source, const SurfaceOrder& order, const Surface& ordered, LevelData& level);

}  // namespace farfield
