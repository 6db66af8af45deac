// SPDX-License-Identifier: Apache-2.0
// What a textured triangle reflects on average: textures are integrated exactly over its footprint in UV space.
#pragma once

#include <array>

#include "import/source_mesh.h"
#include "prefilter/surface.h"

namespace farfield {

/// Texture coordinates of a triangle's corners.
using UvTriangle = std::array<vec2, 3>;

/// Averages over an area of a material's textures, each weighted by alpha when the material is masked. Without the base
/// colour factor and the vertex colour, which are constant there and come in afterwards.
struct TextureAverage {
  vec3 dielectric{1.0f};  ///< base colour times (1 - metallic)
  vec3 metal{0.0f};       ///< base colour times metallic
  float metallic = 0;
  float roughness2 = 1;  ///< roughness^4, which is alpha^2 of GGX
};

/// Of the triangle with these texture coordinates: texels weighted by the exact area that the triangle covers of them,
/// or of texels of a smaller level of the image when it covers very many. Coordinates that are not finite or beyond
/// 1e6 give the average of the whole image, a triangle without area in UV space the texels along it.
TextureAverage average_textures(const SourceMaterial& material, const UvTriangle& uv);

/// The material of a face. `color`: the mean vertex colour, linear. `normal`: unit. What the specular lobe takes at
/// normal incidence is left out of the diffuse one, so diffuse + transmission + specular <= 1 per channel.
FaceMaterial face_material(const SourceMaterial& material, const TextureAverage& average, const vec3& color,
                           const vec3& normal);

/// Alpha at a point of the material's textures, bilinear, times the material's own alpha.
float alpha_at(const SourceMaterial& material, vec2 uv);

/// Whether any texture has to be looked at.
bool has_textures(const SourceMaterial& material);

/// Whether texture coordinates can be used at all: finite and not beyond 1e6, where float has no texels any more.
bool is_usable(const UvTriangle& uv);

}  // namespace farfield
