// SPDX-License-Identifier: Apache-2.0
// Shading normals of corners as files give them, and those that smoothing groups ask for.
#pragma once

#include <cstdint>
#include <span>

#include "import/source_mesh.h"

namespace farfield {

/// Of length 1; (0, 0, 0), which stands for the face's own normal, where the vector has no direction.
vec3 unit_normal(const dvec3& normal);

/// Gives the corners that have no normal and lie in a group the mean, by area, of the normals of the faces around their
/// vertex that are in the same group. groups: one per face; 0 is flat. All indices must be in range.
void smooth_corner_normals(SourceMesh& mesh, std::span<const uint32_t> groups);

}  // namespace farfield
