// SPDX-License-Identifier: Apache-2.0
// What `farfield info` says of a manifest.
#pragma once

#include <string>

#include "cache/manifest.h"

namespace farfield::tool {

/// A head of a few lines and a table with a row per level. `name`: the asset as the user called it.
std::string info_table(const std::string& name, const Manifest& manifest);

/// The same and the rest of the manifest as JSON; keys of levels as in `farfield evaluate --json`.
std::string info_json(const std::string& name, const Manifest& manifest);

/// Part of the voxels of the level's bounding grid that are empty, in [0, 1]; 1 without voxels.
double sparsity(const Manifest& manifest, const LevelEntry& level);

}  // namespace farfield::tool
