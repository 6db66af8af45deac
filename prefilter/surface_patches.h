// SPDX-License-Identifier: Apache-2.0
// Connected parts of a surface that are small against a resolution, and points that stand for faces.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "prefilter/edge_table.h"
#include "prefilter/surface.h"

namespace farfield {

constexpr int next_corner(int corner) { return corner == 2 ? 0 : corner + 1; }

inline dvec3 corner_position(const Surface& surface, uint32_t face, int corner) {
  return dvec3(surface.positions[surface.triangles[face][corner]]);
}

/// The point that stands for the face in an analysis: its centre of mass, of long ones the middle of the longest edge
/// (thesis 7.2.2).
dvec3 evaluation_point(const Surface& surface, uint32_t face);

/// A face that stands for those around it, and which faces those are.
struct Patches {
  std::vector<uint32_t> seeds;          ///< per patch
  std::vector<uint32_t> patch_of_face;  ///< per face
};

/// Grows connected patches around seeds, in face order: corners lie within `radius` of the seed's evaluation point.
/// Faces larger than that stay alone: the thesis's evaluation.
Patches make_patches(const Surface& surface, const EdgeTable& edges, double radius);

/// A part of the surface that lies within a ball, and where it goes on.
struct Blocks {
  std::vector<uint32_t> block_of_face;  ///< per face
  std::vector<uint32_t> face_count;     ///< per block
  std::vector<dvec3> center;            ///< per block: of a ball around all corners of its faces
  std::vector<double> radius;           ///< per block: of that ball
  std::vector<uint32_t> first_outside;  ///< per block, and one past the last: where its faces begin in `outside`
  std::vector<uint32_t> outside;        ///< faces of other blocks that share an edge with one of the block

  std::span<const uint32_t> outside_of(uint32_t block) const {
    return std::span(outside).subspan(first_outside[block], first_outside[block + 1] - first_outside[block]);
  }
};

/// Patches of that radius as blocks.
Blocks make_blocks(const Surface& surface, const EdgeTable& edges, double radius);

}  // namespace farfield
