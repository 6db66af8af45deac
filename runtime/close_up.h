// SPDX-License-Identifier: Apache-2.0
// What level 0 of an asset looks like up close: its own materials with their textures, or the host's function.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "bvh/traced_asset.h"
#include "cache/asset_material.h"
#include "cache/manifest.h"
#include "farfield/material.h"
#include "runtime/texture_cache.h"

namespace farfield {

/// A point on level 0 in the terms of the source.
struct SourcePoint {
  uint32_t material = 0;
  uint32_t source_face = kNoIndex;  ///< kNoIndex: not kept
  vec2 barycentric{0.0f};           ///< weights of the source's second and third corner
  vec2 uv{NAN};
  vec3 normal{0.0f};  ///< shading normal in local space, unit, on either side; 0: the face's own
};

/// What is at a point of level 0; the normal bent by the material's normal map.
struct CloseUpSample {
  SourcePoint at;
  /// Nothing where the face's average is all that is known: no varying material, or its textures cannot be read now.
  std::optional<MaterialSample> material;
};

/// An asset's materials. Refers to the cache. Immutable once made; any thread.
class CloseUp final : public SurfaceLook {
 public:
  /// `function`: the host's; may be empty.
  CloseUp(const std::filesystem::path& folder, const Manifest& manifest, MaterialFunction function,
          TextureCache& textures);

  float opacity(const LevelView& level, const SurfacePoint& point) const override;
  CloseUpSample sample(const LevelView& level, const SurfacePoint& point) const;

  /// The name of a material; empty for a number that there is not.
  const std::string& material_name(uint32_t material) const;
  bool has_textures() const;
  uint64_t table_bytes() const;

 private:
  /// A map of a material: a handle of the cache.
  struct Map {
    uint32_t texture = kNoIndex;
    int channels = 0;
    vec2 size{0.0f};
    explicit operator bool() const { return texture != kNoIndex; }
  };
  struct Material : SurfaceMaterial<Map> {
    Map mask_map;
    bool has_maps = false;
  };
  struct Place;

  const Material* varying_material(const LevelView& level, const Place& place) const;
  std::optional<float> opacity_at(const Material& material, const Place& place) const;
  std::optional<MaterialSample> sample_at(const Material& material, const Place& place) const;
  static vec3 mapped(const Place& place, const vec3& in_frame);
  MaterialSample ask_host(const Place& place, bool opacity_only) const;
  bool look_up(const Map& map, const Place& place, vec4& value) const;

  std::vector<Material> materials_;
  bool has_maps_ = false;  ///< any of them
  MaterialFunction function_;
  const TextureCache& textures_;
};

}  // namespace farfield
