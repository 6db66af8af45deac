// SPDX-License-Identifier: Apache-2.0
// What a baked asset keeps of its source's materials and textures, for close-ups.
#pragma once

#include <cstdint>
#include <string>

#include "base/index.h"
#include "base/surface_material.h"

namespace farfield {

/// A texture file of the asset: tiled, MIP-mapped, linear, colour multiplied with alpha.
struct AssetTexture {
  std::string file;  ///< name inside the asset's folder
  uint64_t file_bytes = 0;
  uint64_t file_hash = 0;
  uint32_t width = 0, height = 0;
  uint32_t channels = 0;     ///< 1 to 4
  uint64_t cache_bytes = 0;  ///< of all its MIP levels in memory
};

/// One of the asset's textures, and how it continues.
struct TextureRef {
  Index texture = kNoIndex;
  Wrap wrap_u = Wrap::Repeat, wrap_v = Wrap::Repeat;

  explicit operator bool() const { return texture != kNoIndex; }
};

struct AssetMaterial : SurfaceMaterial<TextureRef> {
  /// Of AlphaMode::Mask in place of the other maps' alpha: its product, and the share of the texel that the mask leaves
  /// where vertex colours have alpha 1.
  TextureRef mask_map;
};

}  // namespace farfield
