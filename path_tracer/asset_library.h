// SPDX-License-Identifier: Apache-2.0
// Where the baked assets of a scene lie, and baking those that are missing.
//
//   ASSETS/forest/small_maple.farfield          mesh "small_maple" of forest.glb
//   ASSETS/forest/small_maple.source.farfield   its level 0 alone, for --full-detail where there is nothing else
//
// ASSETS is --assets, or "farfield-assets" in the scene's own folder.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "import/gltf_scene.h"
#include "path_tracer/render_job.h"

namespace farfield {

/// The folder that holds the assets of options.scene: ASSETS/forest above.
std::filesystem::path asset_library_folder(const RenderOptions& options);

/// For each mesh of the scene the folder of its baked asset, up to date with the scene and the options; empty for
/// meshes that no instance shows, that have no triangles, or that cannot be baked while others can: each of those is a
/// warning, and the scene is shown without it. Warnings of the bakes are said, too. What is missing or stale is baked
/// by one process (`farfield bake SCENE --scene -o LIBRARY`), started only if there is any, so that this one's memory
/// stays what rendering needs; it ends when this one does, however that comes. Errors: Io (the bake cannot be started),
/// BadFile (it was killed), Unsupported (no mesh could be baked; the bake has said why on standard error), Cancelled.
Result<std::vector<std::filesystem::path>> find_or_bake_assets(const GltfScene& scene, const RenderOptions& options);

}  // namespace farfield
