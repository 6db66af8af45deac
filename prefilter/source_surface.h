// SPDX-License-Identifier: Apache-2.0
// The source, conditioned: clean triangles with all that close-ups show of it. Level 0 is made of this.
#pragma once

#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "farfield/material.h"
#include "import/source_mesh.h"

namespace farfield {

/// Triangles over welded vertices. What varies inside a face lies at its corners: corner c of triangle t is 3 t + c.
/// Arrays of corners are empty where the source says nothing.
struct SourceSurface {
  std::vector<vec3> positions;     ///< relative to `origin`, finite
  std::vector<uvec3> triangles;    ///< with area; no repeated index, no triangle twice
  std::vector<vec2> corner_uv;     ///< v points down the image
  std::vector<vec4> corner_color;  ///< linear RGBA
  std::vector<vec3>
      corner_normal;  ///< shading normal, unit; on the side of the face's winding where the source has it so
  std::vector<vec4> corner_tangent;   ///< along u, unit or 0; w: handedness
  std::vector<uint32_t> material;     ///< per triangle: index into `materials`
  std::vector<uint32_t> source_face;  ///< per triangle: the polygon of the file that it is a part of
  std::vector<SourceMaterial> materials;
  MaterialFunction material_function;  ///< the host's, if it has one: then `materials` give names only
  dvec3 origin{0.0};  ///< of positions in the source's space; (0,0,0) unless the source lies far from its origin

  Box3 bounds() const;
  /// Unit normal of a triangle's plane.
  vec3 face_normal(size_t triangle) const;
};

}  // namespace farfield
