// SPDX-License-Identifier: Apache-2.0
// A surface's material as glTF's metallic-roughness model says it: what sources are read into and what baked assets
// keep of them for close-ups.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "base/vec.h"

namespace farfield {

/// How an image continues outside [0, 1]^2.
enum class Wrap : uint8_t { Repeat, Clamp, Mirror };

enum class AlphaMode : uint8_t {
  Opaque,
  Mask,   ///< there where alpha >= alpha_cutoff, not there elsewhere
  Blend,  ///< alpha is the share of the light that meets it
};

/// What a material says without its maps. Defaults are those of a face without any material: Blender's grey, without a
/// specular lobe.
struct MaterialFactors {
  std::string name;                       ///< as the file has it; may be empty
  vec3 base_color{0.8f};                  ///< linear; multiplies texture and vertex colour
  float alpha = 1;                        ///< multiplies the textures' and the vertex colours' alpha
  float metallic = 0;                     ///< multiplies metallic_roughness.b
  float roughness = 1;                    ///< multiplies metallic_roughness.g
  vec3 dielectric_f0{0.0f};               ///< reflectance at normal incidence of the part that is not metal
  float diffuse_transmission = 0;         ///< share of the diffuse light that goes through
  vec3 diffuse_transmission_color{1.0f};  ///< linear
  AlphaMode alpha_mode = AlphaMode::Opaque;
  float alpha_cutoff = 0.5f;
  float normal_scale = 1;       ///< multiplies x and y of normal_map
  vec3 emission{0.0f};          ///< linear radiance, may exceed 1
  float thin_transmission = 0;  ///< share of the light that goes straight through (KHR_transmission): opacity
};

/// Map: a texture and how it wraps; false when there is none.
template <typename Map>
struct SurfaceMaterial : MaterialFactors {
  Map base_color_map;          ///< linear RGB, alpha (1 where the material ignores it)
  Map metallic_roughness_map;  ///< g: roughness, b: metallic
  Map alpha_map;               ///< OBJ's map_d: its alpha channel multiplies
  Map normal_map;              ///< tangent space, as stored: (r, g, b) in [0, 1] is 2 (r, g, b) - 1
  Map emission_map;            ///< linear RGB; multiplies emission

  /// All of them, in this order.
  std::array<Map*, 5> maps() {
    return {&base_color_map, &metallic_roughness_map, &alpha_map, &normal_map, &emission_map};
  }
  std::array<const Map*, 5> maps() const {
    return {&base_color_map, &metallic_roughness_map, &alpha_map, &normal_map, &emission_map};
  }
};

}  // namespace farfield
