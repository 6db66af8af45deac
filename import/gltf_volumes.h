// SPDX-License-Identifier: Apache-2.0
// Volumes that nodes of a glTF file name: docs/scene_format.md, "Volumes". Internal to the room.
#pragma once

#include <tiny_gltf.h>

#include <optional>
#include <string>

#include "base/result.h"
#include "import/fog_options.h"

namespace farfield {

struct NamedVolume {
  std::string file;  ///< relative to the folder of the glTF file
  FogOptions fog;
};

/// What the extras "farfield_volume" of a node say; nothing if there are none. Errors: BadFile, one line without the
/// node.
Result<std::optional<NamedVolume>> volume_of_extras(const tinygltf::Node& node);

}  // namespace farfield
