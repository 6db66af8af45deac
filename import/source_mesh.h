// SPDX-License-Identifier: Apache-2.0
// What the readers of OBJ, PLY and glTF hand to the import: polygons as the file has them, with corner attributes and
// materials, before any geometry is touched.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/hash.h"
#include "base/result.h"
#include "base/vec.h"
#include "farfield/material.h"
#include "import/texture.h"

namespace farfield {

enum class Wrap { Repeat, Clamp, Mirror };

/// An image and how it continues outside [0, 1]^2.
struct SourceTexture {
  std::shared_ptr<const Texture> image;  ///< null: no texture
  Wrap wrap_u = Wrap::Repeat, wrap_v = Wrap::Repeat;

  explicit operator bool() const { return image != nullptr; }
};

enum class AlphaMode : uint8_t {
  Opaque,
  Mask,   ///< there where alpha >= alpha_cutoff, not there elsewhere
  Blend,  ///< alpha is the share of the light that meets it
};

/// A material as glTF's metallic-roughness model says it; the other formats are mapped to it by their readers.
/// Defaults are those of a face without any material: Blender's grey, without a specular lobe.
struct SourceMaterial {
  std::string name;                       ///< as the file has it; may be empty
  vec3 base_color{0.8f};                  ///< linear; multiplies texture and vertex colour
  float alpha = 1;                        ///< multiplies the textures' and the vertex colours' alpha
  float metallic = 0;                     ///< multiplies metallic_roughness.b
  float roughness = 1;                    ///< multiplies metallic_roughness.g
  vec3 dielectric_f0{0.0f};               ///< reflectance at normal incidence of the part that is not metal
  float diffuse_transmission = 0;         ///< share of the diffuse light that goes through
  vec3 diffuse_transmission_color{1.0f};  ///< linear
  SourceTexture base_color_map;           ///< linear RGB, alpha (1 where the material ignores it)
  SourceTexture metallic_roughness_map;   ///< g: roughness, b: metallic
  SourceTexture alpha_map;                ///< OBJ's map_d: its alpha channel multiplies
  AlphaMode alpha_mode = AlphaMode::Opaque;
  float alpha_cutoff = 0.5f;
  SourceTexture normal_map;     ///< tangent space, as stored: (r, g, b) in [0, 1] is 2 (r, g, b) - 1
  float normal_scale = 1;       ///< multiplies x and y of normal_map
  vec3 emission{0.0f};          ///< linear radiance, may exceed 1
  SourceTexture emission_map;   ///< linear RGB; multiplies emission
  float thin_transmission = 0;  ///< share of the light that goes straight through (KHR_transmission): opacity
};

struct SourceMesh {
  std::vector<dvec3> positions;
  std::vector<uint32_t> face_begin{0};    ///< face i has the corners face_begin[i] .. face_begin[i + 1] - 1
  std::vector<uint32_t> corner_position;  ///< index into positions; checked by the readers
  std::vector<vec2> corner_uv;            ///< empty, or one per corner; v points down the image
  std::vector<vec4> corner_color;         ///< empty, or one per corner; linear RGBA
  std::vector<vec3> corner_normal;        ///< empty, or one per corner: shading normal, any length; 0: the face's own
  std::vector<vec4> corner_tangent;       ///< empty, or one per corner: along u, any length (0: from uv); w: handedness
  std::vector<uint32_t> face_material;    ///< index into materials
  std::vector<SourceMaterial> materials;
  MaterialFunction material_function;    ///< a host's own; if set, `materials` give names and modes only
  std::vector<std::string> warnings;     ///< one line each
  std::vector<HashedFile> source_files;  ///< that the main file refers to, relative to its folder, in order of use
  uint64_t source_hash = 0;              ///< see hash_source(); set by read_source()

  size_t face_count() const { return face_material.size(); }
  size_t corner_count() const { return corner_position.size(); }
};

}  // namespace farfield
