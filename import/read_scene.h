// SPDX-License-Identifier: Apache-2.0
// Whatever can be rendered, as a scene: a glTF file, or an OpenVDB file alone.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "import/gltf_scene.h"

namespace farfield {

struct SceneOptions {
  AssemblyRule assemblies = AssemblyRule::Repeated;  ///< of glTF
  FogOptions fog;                                    ///< of an OpenVDB file alone
  bool tiles = true;                                 ///< of glTF: cut_into_tiles()
};

/// Of an OpenVDB file: one instance of its volume where the file has it, and nothing else. Errors: those of
/// read_gltf_scene() and read_volume_extent().
Result<GltfScene> read_scene(const std::filesystem::path& path, const SceneOptions& options = {});

}  // namespace farfield
