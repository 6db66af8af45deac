// SPDX-License-Identifier: Apache-2.0
// What a textured triangle reflects on average: textures are integrated exactly over its footprint in UV space.
#pragma once

#include "import/source_mesh.h"
#include "prefilter/source_surface.h"
#include "scattering/material_model.h"

namespace farfield {

/// What a material's maps say on average over the triangle with these texture coordinates: texels weighted by the exact
/// area that the triangle covers of them, or of texels of a smaller level of the image when it covers very many; and by
/// alpha. Coordinates that are not finite or beyond 1e6 give the average of the whole image, a triangle without area in
/// UV space the texels along it. `vertex_alpha` multiplies alpha.
MapMeans average_textures(const SourceMaterial& material, const UvTriangle& uv, float vertex_alpha = 1);

/// The same of a spot of this width, in texture coordinates, around a point: maps scaled down so that a texel is about
/// as large are looked at, bilinear.
MapMeans textures_at(const SourceMaterial& material, vec2 uv, float width, float vertex_alpha = 1);

/// Alpha at a point of the material's textures, bilinear, times the material's own alpha.
float alpha_at(const SourceMaterial& material, vec2 uv);

/// Whether any texture has to be looked at.
bool has_textures(const SourceMaterial& material);

/// Whether texture coordinates can be used at all: finite and not beyond 1e6, where float has no texels any more.
bool is_usable(const UvTriangle& uv);

}  // namespace farfield
