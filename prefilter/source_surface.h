// SPDX-License-Identifier: Apache-2.0
// The source, conditioned: clean triangles with all that close-ups show of it. Level 0 is made of this.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "farfield/material.h"
#include "import/source_mesh.h"

namespace farfield {

/// Texture coordinates of a triangle's corners.
using UvTriangle = std::array<vec2, 3>;

/// A place of a mesh that the source may show in several.
struct SurfacePlacement {
  uint32_t mesh = 0;
  glm::dmat4x3 to_surface{1.0};  ///< from the mesh's space to that of positions
};

/// Triangles over welded vertices. What varies inside a face lies at its corners: corner c of triangle t is 3 t + c.
/// Arrays of corners are empty where the source says nothing.
struct SourceSurface {
  std::vector<vec3> positions;        ///< relative to `origin`, finite
  std::vector<uvec3> triangles;       ///< with area; no repeated index, no triangle twice
  std::vector<vec2> corner_uv;        ///< v points down the image; may be unusable
  std::vector<vec4> corner_color;     ///< linear RGBA
  std::vector<vec3> corner_normal;    ///< shading normals, unit, on either side
  std::vector<uint32_t> material;     ///< per triangle: index into `materials`
  std::vector<uint32_t> source_face;  ///< per triangle: the polygon of the file that it is a part of
  std::vector<uint32_t> quad;         ///< per triangle, as Surface::quad: halves of polygons with four corners
  std::vector<uint8_t> on_cut;  ///< per vertex: other tiles have it too, it stays where it is; empty: this is no tile
  std::vector<uint32_t> placement;  ///< per triangle: index into placements or kNoIndex; empty: nothing is repeated
  std::vector<SurfacePlacement> placements;
  std::vector<SourceMaterial> materials;
  MaterialFunction material_function;    ///< the host's, if it has one: then `materials` give names only
  MaterialBatchFunction material_batch;  ///< answers as material_function, many places at once; may be empty
  dvec3 origin{0.0};  ///< of positions in the source's space; (0,0,0) unless the source lies far from its origin

  Box3 bounds() const;
  /// Twice the area times the unit normal of a triangle, in double: single precision calls needles flat.
  dvec3 area_vector(size_t triangle) const;
  /// The corners' texture coordinates; NaN where the source has none.
  UvTriangle uv_of(size_t triangle) const;
  /// At a point of a triangle; white where the source has no colours.
  vec4 color_at(size_t triangle, const vec3& barycentric) const;
  /// The unit shading normal at a point of a triangle; the triangle's own where the source has none.
  vec3 normal_at(size_t triangle, const vec3& barycentric) const;
  const SourceMaterial& material_of(size_t triangle) const { return materials[material[triangle]]; }
  /// Whether light may see other normals than the triangles' own.
  bool has_shading_normals() const;
};

}  // namespace farfield
