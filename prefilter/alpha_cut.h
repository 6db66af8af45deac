// SPDX-License-Identifier: Apache-2.0
// Alpha-masked faces become geometry: they are cut along the outline of the mask.
#pragma once

#include <span>

#include "prefilter/face_textures.h"

namespace farfield {

/// A triangle of a masked material: texture coordinates and vertex alphas of its corners.
struct MaskedTriangle {
  UvTriangle uv;
  std::array<float, 3> alpha{1, 1, 1};

  friend bool operator==(const MaskedTriangle&, const MaskedTriangle&) = default;
};

/// What the mask leaves of a triangle. Where neighbours have the same texture coordinates on their common edge, both
/// are cut there at exactly the same points, so the pieces fit without cracks or T-junctions.
struct CutPattern {
  std::vector<vec3> vertices;    ///< barycentric; on an edge the third coordinate is exactly 0
  std::vector<uvec3> triangles;  ///< indices into vertices, wound like the triangle that was cut
  float coverage = 0;            ///< their share of the triangle's area

  bool is_whole() const { return coverage == 1 && triangles.size() == 1; }
};

/// How finely the edges of these triangles have to be sampled to see every texel of the mask: a power of two in
/// [1, 1024], the same for all triangles of a material, or their cuts would not fit.
int cut_subdivisions(const SourceMaterial& material, std::span<const MaskedTriangle> triangles);

/// How far outlines may be straightened where nothing says how large a texel is, in texels.
inline constexpr double kOutlineTexels = 3.5;

/// The largest extent of a texel on a triangle with these corners: along its edges, in their unit. 0: not known, for
/// coordinates that span no texel.
double texel_size(const SourceMaterial& material, const MaskedTriangle& triangle, const std::array<vec3, 3>& corners);

/// Cuts along alpha = material.alpha_cutoff. The outline is found by marching triangles on a lattice of
/// subdivisions^2 small triangles, straightened by up to `tolerance_texels` as far as the covered area stays within
/// 0.5 %, and filled with triangles. Unusable texture coordinates leave the triangle whole.
CutPattern cut_by_mask(const SourceMaterial& material, const MaskedTriangle& triangle, int subdivisions,
                       double tolerance_texels = kOutlineTexels);

}  // namespace farfield
