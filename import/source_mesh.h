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
#include "import/texture.h"

namespace farfield {

enum class Wrap { Repeat, Clamp, Mirror };

/// An image and how it continues outside [0, 1]^2.
struct SourceTexture {
  std::shared_ptr<const Texture> image;  ///< null: no texture
  Wrap wrap_u = Wrap::Repeat, wrap_v = Wrap::Repeat;

  explicit operator bool() const { return image != nullptr; }
};

/// A material as glTF's metallic-roughness model says it; the other formats are mapped to it by their readers.
/// Defaults are those of a face without any material: Blender's grey, without a specular lobe.
struct SourceMaterial {
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
  bool is_masked = false;                 ///< cut away where alpha < alpha_cutoff
  float alpha_cutoff = 0.5f;
};

struct SourceMesh {
  std::vector<dvec3> positions;
  std::vector<uint32_t> face_begin{0};    ///< face i has the corners face_begin[i] .. face_begin[i + 1] - 1
  std::vector<uint32_t> corner_position;  ///< index into positions; checked by the readers
  std::vector<vec2> corner_uv;            ///< empty, or one per corner; v points down the image
  std::vector<vec4> corner_color;         ///< empty, or one per corner; linear RGBA
  std::vector<uint32_t> face_material;    ///< index into materials
  std::vector<SourceMaterial> materials;
  std::vector<std::string> warnings;     ///< one line each
  std::vector<HashedFile> source_files;  ///< that the main file refers to, relative to its folder, in order of use
  uint64_t source_hash = 0;              ///< see hash_source(); set by read_source()

  size_t face_count() const { return face_material.size(); }
  size_t corner_count() const { return corner_position.size(); }
};

}  // namespace farfield
