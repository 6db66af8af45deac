// SPDX-License-Identifier: Apache-2.0
// A level's volume as grids of an OpenVDB file: docs/export.md has their names and meanings.
#pragma once

#include <string>
#include <vector>

#include "export/exported_level.h"
#include "import/write_volume.h"

namespace farfield {

/// Grids of one level, which must have a volume; their names end in `suffix`. Valid while the level lives. Only what
/// the level has: an absent array has no grid, but that "albedo" is always there.
std::vector<VolumeGrid> level_grids(const LevelOfAsset& from, const std::string& suffix);

}  // namespace farfield
