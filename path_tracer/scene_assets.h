// SPDX-License-Identifier: Apache-2.0
// The assets of a scene: which there are, where they lie, and baking them in this process, one after the other.
//
//   LIBRARY/small_maple.farfield          mesh "small_maple" of forest.glb
//   LIBRARY/small_maple.source.farfield   its level 0 alone, for --full-detail
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "base/job.h"
#include "base/result.h"
#include "import/read_scene.h"

namespace farfield {

/// How a scene's assets are baked.
struct SceneBakeOptions {
  std::filesystem::path scene;    ///< .gltf, .glb or .vdb
  std::filesystem::path library;  ///< folder of the assets, created
  uint32_t finest_grid = 512, coarsest_grid = 8;
  uint32_t rays_per_voxel = 200;
  bool source_only = false;  ///< level 0 alone
  SceneOptions read;
  Downsampling downsampling = Downsampling::Matched;  ///< of volumes
  SubdivisionOptions subdivision;                     ///< of all meshes
  /// Only each part_count-th asset, from number `part` on: for processes that share the work. part < part_count.
  uint32_t part = 0, part_count = 1;

  /// Told of each asset before it is baked, and how it went. May be empty.
  std::function<void(const std::string& asset)> begin;
  std::function<void(const std::string& asset, const Result<BakeReport>& report)> end;
  std::function<void(const std::string& line)> warning;  ///< of the scene; may be empty
  Job job;
};

/// For each mesh of the scene whether its asset is needed: some instance shows it, and it is not empty.
std::vector<bool> assets_in_use(const GltfScene& scene);

/// Where the asset of a mesh lies.
std::filesystem::path asset_folder(const SceneBakeOptions& options, const GltfMesh& mesh);

/// The file that the asset of a mesh is baked from.
std::filesystem::path asset_source(const SceneBakeOptions& options, const GltfMesh& mesh);

/// How the asset of mesh number `mesh` is baked. `hashes` outlives what is returned.
BakeOptions asset_bake_options(const SceneBakeOptions& options, const GltfScene& scene, size_t mesh,
                               FileHashes& hashes);

/// Bakes all assets of a scene (of its part) that are missing or stale; one that cannot be baked does not keep the
/// others from it. Returns how many failed. Errors: those of read_scene; Io (the library cannot be created),
/// Cancelled.
Result<size_t> bake_scene_assets(const SceneBakeOptions& options);

}  // namespace farfield
