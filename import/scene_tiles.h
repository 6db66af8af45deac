// SPDX-License-Identifier: Apache-2.0
// Which meshes of a scene are cut into tiles: grounds, whose near part needs level 0 and whose rest does not.
#pragma once

#include <cstdint>

#include "import/gltf_scene.h"

namespace farfield {

/// About how many triangles a tile has: up to so many, more than half of it (docs/decisions/0037).
inline constexpr uint64_t kTileTriangles = 2048;

/// Puts tiles, assets of their own, in the place of what is a ground: a mesh, assembly or file of at least two tiles'
/// triangles that is flat (a quarter as high as wide), shown a few times at the most, and far wider than most of what
/// stands in the scene. Names, nodes and data of instances stay. Adds a warning for each that says what was cut.
/// Depends on nothing but the scene.
void cut_into_tiles(GltfScene& scene);

}  // namespace farfield
