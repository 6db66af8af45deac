// SPDX-License-Identifier: Apache-2.0
// What level 0 keeps of the source's materials: textures that can be paged in, written into the asset.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "cache/asset_material.h"
#include "prefilter/source_surface.h"

namespace farfield {

struct AssetLook {
  std::vector<AssetMaterial> materials;  ///< as many as the source has
  std::vector<AssetTexture> textures;
};

/// Files of textures by the hash of their bytes.
using TextureFiles = std::map<uint64_t, std::filesystem::path>;

/// Writes each image that the source's materials use into `folder`, once per way of use, as texture_N.tif. Same source,
/// same bytes. What is equal to a `known` file becomes a hard link to it where the file system has such. Errors: Io,
/// Cancelled.
Result<AssetLook> write_textures(const SourceSurface& source, const std::filesystem::path& folder,
                                 const TextureFiles& known, const Job& job);

/// Per texture: how much of the surface one of its texels covers at most, in scene units squared; 0 where nothing says.
std::vector<double> texel_areas(const SourceSurface& source, const AssetLook& look);

/// What the textures would take in memory if their texels were no smaller than `resolution` (scene units) on the
/// surface: what a level of that resolution is weighed against.
uint64_t texture_bytes_at(const std::vector<double>& texel_areas, const AssetLook& look, double resolution);

}  // namespace farfield
