// SPDX-License-Identifier: Apache-2.0
// What the voxels of a grid are, by their edges: only cubes are a medium that looks alike from all sides.
#pragma once

#include <array>
#include <string>

#include "base/vec.h"

namespace farfield {

struct VoxelShape {
  bool is_singular = false;  ///< an edge has no length, or none that is a number
  std::string other_shape;   ///< "2 x 1 x 1", "1 x 1 x 1, sheared"; empty: a cube
  double size = 0;           ///< of the cube
  glm::dmat3 rotation{1.0};  ///< columns: its edges, of length 1; exactly upright, may mirror

  bool is_cube() const { return !is_singular && other_shape.empty(); }
};

/// Exactly the identity for edges along the axes.
VoxelShape voxel_shape(const std::array<dvec3, 3>& edges);

}  // namespace farfield
