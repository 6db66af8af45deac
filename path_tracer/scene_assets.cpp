// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/scene_assets.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <system_error>

#include "base/free_memory.h"
#include "base/result.h"

namespace farfield {

namespace fs = std::filesystem;

namespace {

// Of the assets in use, those of this part.
std::vector<size_t> numbers_to_bake(const SceneBakeOptions& options, const GltfScene& scene) {
  const std::vector<bool> in_use = assets_in_use(scene);
  std::vector<size_t> numbers;
  uint32_t count = 0;
  for (size_t mesh = 0; mesh < in_use.size(); ++mesh)
    if (in_use[mesh] && count++ % options.part_count == options.part) numbers.push_back(mesh);
  return numbers;
}

// The stages of an asset's bake, with its name before them and its share of the whole.
Job job_of_asset(const Job& all, const std::string& asset, size_t number, size_t count) {
  if (!all.progress) return {{}, all.cancel};
  const auto progress = [&all, asset, number, count](double done, const std::string& stage) {
    all.report((static_cast<double>(number) + done) / static_cast<double>(count),
               fmt::format("{} ({}/{}): {}", asset, number + 1, count, stage));
  };
  return {progress, all.cancel};
}

}  // namespace

std::vector<bool> assets_in_use(const GltfScene& scene) {
  std::vector<bool> in_use(scene.meshes.size(), false);
  for (const GltfInstance& instance : scene.instances) in_use[instance.mesh] = !scene.meshes[instance.mesh].is_empty();
  return in_use;
}

fs::path asset_folder(const SceneBakeOptions& options, const GltfMesh& mesh) {
  return options.library / (mesh.asset_name + (options.source_only ? ".source.farfield" : ".farfield"));
}

fs::path asset_source(const SceneBakeOptions& options, const GltfMesh& mesh) {
  // A tile has the names of its mesh.
  const std::string& own_file = mesh.volume.empty() ? mesh.model : mesh.volume;
  return own_file.empty() ? options.scene : options.scene.parent_path() / own_file;
}

BakeOptions asset_bake_options(const SceneBakeOptions& options, const GltfScene& scene, size_t mesh,
                               FileHashes& hashes) {
  BakeOptions bake;
  bake.finest_grid = options.finest_grid;
  bake.coarsest_grid = options.coarsest_grid;
  bake.rays_per_voxel = options.rays_per_voxel;
  bake.source_only = options.source_only;
  bake.downsampling = options.downsampling;
  bake.import.fog = scene.meshes[mesh].fog;
  if (!scene.meshes[mesh].volume.empty()) return bake;
  bake.import.subdivision = options.subdivision;
  bake.import.subdivision.scheme = scene.meshes[mesh].scheme.value_or(options.subdivision.scheme);
  if (scene.meshes[mesh].model.empty()) {
    const bool is_tile = scene.meshes[mesh].tile.is_part();
    bake.import.node = scene.meshes[mesh].node;
    if (bake.import.node < 0) bake.import.mesh = static_cast<int>(is_tile ? scene.meshes[mesh].whole : mesh);
  }
  bake.import.tile = scene.meshes[mesh].tile;
  bake.import.known_hashes = &hashes;
  return bake;
}

Result<size_t> bake_scene_assets(const SceneBakeOptions& options) {
  FARFIELD_TRY_LET(auto scene, read_scene(options.scene, options.read));
  for (const std::string& warning : scene.warnings)
    if (options.warning) options.warning(warning);
  std::error_code error;
  fs::create_directories(options.library, error);
  if (error)
    return make_error(ErrorCode::Io, fmt::format("cannot create {}: {}", options.library.string(), error.message()));

  size_t failed = 0;
  FileHashes hashes;  // the scene is read once for them, however many assets it has
  KnownMesh whole;    // and a mesh once for its tiles, which follow each other
  TextureFiles textures_of_tiles;
  const std::vector<size_t> numbers = numbers_to_bake(options, scene);
  free_memory(scene.instances);  // a million take as much as a bake
  for (size_t i = 0; i < numbers.size(); ++i) {
    const GltfMesh& mesh = scene.meshes[numbers[i]];
    BakeOptions how = asset_bake_options(options, scene, numbers[i], hashes);
    how.import.known_mesh = &whole;
    if (mesh.tile.is_part())
      how.known_textures = textures_of_tiles;
    else
      whole.forget();
    how.job = job_of_asset(options.job, mesh.asset_name, i, numbers.size());
    if (options.begin) options.begin(mesh.asset_name);
    const auto report = bake(asset_source(options, mesh), asset_folder(options, mesh), how);
    if (!report && report.error().code == ErrorCode::Cancelled) return tl::unexpected(report.error());
    if (!report) ++failed;
    if (report && mesh.tile.is_part())
      for (const AssetTexture& texture : report->manifest.textures)
        textures_of_tiles.try_emplace(texture.file_hash, asset_folder(options, mesh) / texture.file);
    if (options.end) options.end(mesh.asset_name, report);
    malloc_trim(0);  // the next one starts as small as in a process of its own
  }
  return failed;
}

}  // namespace farfield
