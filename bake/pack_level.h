// SPDX-License-Identifier: Apache-2.0
// From what the bake computes with (full precision, any order) to what a level file holds (cache/level.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/index.h"
#include "cache/level.h"
#include "prefilter/surface.h"
#include "prefilter/voxelize.h"

namespace farfield {

/// The final numbering of a surface: triangles paired into quads, quads along a Morton curve, faces in the order of the
/// quads, vertices in the order of their first use.
struct SurfaceOrder {
  std::vector<Quad> quads;              ///< in final vertex numbers
  std::vector<uint32_t> vertex_number;  ///< for each vertex of the surface: its final number or kNoIndex
  std::vector<uint32_t> face_number;    ///< for each triangle: its final number
};

/// Pairs and orders: first the halves of the surface's own quads. Two triangles become a quad when they share an edge
/// and have the same winding; their shared edge is the quad's diagonal v1-v3, so that the quad is exactly the two
/// triangles. Depends only on the surface. part: empty, or per triangle a number; those of a part share no vertices
/// with others and stay together, parts in ascending order.
SurfaceOrder order_surface(const Surface& surface, std::span<const uint32_t> part = {});

/// The surface with vertices (without unused ones) and triangles in their final order. Corners of a triangle may be
/// rotated: face 0 of a quad is (v0, v1, v3), face 1 is (v2, v3, v1).
Surface reorder(const Surface& surface, const SurfaceOrder& order);

/// Maps from the previous stored level, in final numbers of both.
struct MorphMaps {
  std::vector<uint32_t> vertex;  ///< as LevelArrays::morph_vertex
  std::vector<uint32_t> face;    ///< as LevelArrays::morph_face
};

/// Packs a volume alone: a level with neither number nor surface, whose resolution is the voxel size. Densities become
/// bytes per brick, none of them 0. A channel whose values are all the default is left out. header.bounds covers the
/// stored voxels. An empty volume gives a level without volume and with empty bounds.
LevelData pack_volume(const SparseVolume& volume);

/// Completes a level: `volume` (from pack_volume) gets its number, resolution, surface and morph map. `surface` is in
/// final order (the result of reorder with `order`). header.bounds covers surface and volume.
LevelData pack_level(uint32_t level, double resolution, const Surface& surface, const SurfaceOrder& order,
                     LevelData volume, MorphMaps morph);

}  // namespace farfield
