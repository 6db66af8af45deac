// SPDX-License-Identifier: Apache-2.0
// Materials and textures in manifest.json.
#pragma once

#include <vector>

#include "cache/asset_material.h"
#include "cache/json_reader.h"
#include "cache/manifest.h"

namespace farfield {

std::vector<AssetTexture> textures_from_json(const Json& manifest, FieldReader& read);
std::vector<AssetMaterial> materials_from_json(const Json& manifest, FieldReader& read);
OrderedJson to_json(const std::vector<AssetTexture>& textures);
OrderedJson to_json(const std::vector<AssetMaterial>& materials);

/// Counts and values out of range, and references to textures that are not there.
Problem find_material_problem(const Manifest& manifest);

}  // namespace farfield
