// SPDX-License-Identifier: Apache-2.0
// A mesh that is cut into tiles, which are baked as assets of their own: docs/decisions/0037.
#pragma once

#include <cstdint>

#include "base/hash.h"

namespace farfield {

/// One of the parts that a mesh is cut into; all of it where there is one only.
struct MeshTile {
  uint32_t number = 0, count = 1;  ///< number < count

  bool is_part() const { return count > 1; }
};

/// Goes up when tiles get other faces.
inline constexpr uint64_t kTilesVersion = 1;

/// The source_hash of a tile, from that of the mesh.
inline uint64_t tile_hash(uint64_t mesh_hash, const MeshTile& tile) {
  if (!tile.is_part()) return mesh_hash;
  return mix64(mix64(mesh_hash, kTilesVersion), uint64_t{tile.count} << 32 | tile.number);
}

}  // namespace farfield
