// SPDX-License-Identifier: Apache-2.0
// Whatever can be rendered, as a scene: a glTF file, or an OpenVDB file alone.
#pragma once

#include <cstdint>
#include <filesystem>

#include "base/result.h"
#include "import/gltf_scene.h"

namespace farfield {

/// Smaller tiles cost more than they give [measured: docs/decisions/0037].
inline constexpr uint64_t kTileTriangles = 65536;

struct SceneOptions {
  AssemblyRule assemblies = AssemblyRule::Repeated;  ///< of glTF
  FogOptions fog;                                    ///< of an OpenVDB file alone
  uint64_t tile_triangles = kTileTriangles;          ///< of glTF: cut_into_tiles(); 0: nothing is cut
};

/// Of an OpenVDB file: one instance of its volume where the file has it, and nothing else. Errors: those of
/// read_gltf_scene() and read_volume_extent().
Result<GltfScene> read_scene(const std::filesystem::path& path, const SceneOptions& options = {});

}  // namespace farfield
