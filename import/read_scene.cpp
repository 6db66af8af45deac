// SPDX-License-Identifier: Apache-2.0
#include "import/read_scene.h"

#include "base/result.h"
#include "import/read_volume.h"
#include "import/scene_tiles.h"

namespace farfield {

Result<GltfScene> read_scene(const std::filesystem::path& path, const SceneOptions& options) {
  if (!is_volume_file(path)) {
    FARFIELD_TRY_LET(auto scene, read_gltf_scene(path, options.assemblies));
    if (options.tile_triangles > 0) cut_into_tiles(scene, options.tile_triangles);
    return scene;
  }
  FARFIELD_TRY_LET(const auto extent, read_volume_extent(path, options.fog));
  GltfMesh volume;
  volume.name = volume.asset_name = path.stem().string();
  volume.bounds = {vec3(extent.lower), vec3(extent.upper)};
  volume.volume = path.filename().string();
  volume.fog = options.fog;
  GltfScene scene;
  scene.meshes.push_back(std::move(volume));
  scene.nodes.emplace_back();
  scene.instances.push_back({0, mat4x3(1), path.filename().string(), 0, {}});
  return scene;
}

}  // namespace farfield
