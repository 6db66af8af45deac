// SPDX-License-Identifier: Apache-2.0
// What `farfield info` says of a volume that is not baked yet.
#pragma once

#include <string>

#include "import/source_volume.h"

namespace farfield::tool {

/// A few lines: extent, voxels, densities, albedos, and the import's warnings. `name`: the source as the user called
/// it.
std::string volume_table(const std::string& name, const SourceVolume& volume);

/// The same as JSON.
std::string volume_json(const std::string& name, const SourceVolume& volume);

}  // namespace farfield::tool
