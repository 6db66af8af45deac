// SPDX-License-Identifier: Apache-2.0
// One tile of a large mesh (docs/decisions/0037): what is cut is the finished source, so that normals, subdivision and
// displacement know nothing of cuts.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "import/mesh_tile.h"
#include "prefilter/resolve.h"
#include "prefilter/source_surface.h"

namespace farfield {

/// The faces of a tile, with what is theirs at vertices and corners. Each face is in just one tile; tiles are halves of
/// halves, along the widest axis, and of about as many faces each. Materials keep their numbers, those of other tiles
/// lose their textures. Vertices that other tiles have too are `on_cut`. Empty where there are fewer faces than tiles.
SourceSurface cut_tile(const SourceSurface& whole, const MeshTile& tile);

/// Where vertices stay in all levels, so that neighbouring tiles meet whatever their levels are: those of the source on
/// cuts, and those that resolve() puts between them (and, for simplicity, on what continues a border from there). They
/// are known by their positions, which do not change.
class CutPoints {
 public:
  CutPoints() = default;
  CutPoints(const SourceSurface& source, const ResolvedSurface& resolved);

  /// Per vertex whether it is one of them; empty if there are none.
  std::vector<uint8_t> find(std::span<const vec3> positions) const;

 private:
  std::vector<vec3> points_;  ///< ascending
};

}  // namespace farfield
