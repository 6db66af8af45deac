// SPDX-License-Identifier: Apache-2.0
// Which meshes of a scene are cut into tiles: grounds, whose near part needs level 0 and whose rest does not.
#pragma once

#include <cstdint>

#include "import/gltf_scene.h"

namespace farfield {

/// Puts tiles, assets of their own of up to about `tile_triangles` (> 0) each and more than half of that, in the place
/// of what is a ground: a mesh, assembly or file of more than two tiles that is flat (a quarter as high as wide), shown
/// a few times at the most, and far wider than most of what stands in the scene. Names, nodes and data of instances
/// stay. Adds a warning for each that says what was cut. Depends on nothing but the scene: docs/decisions/0037.
void cut_into_tiles(GltfScene& scene, uint64_t tile_triangles);

}  // namespace farfield
