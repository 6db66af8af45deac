// SPDX-License-Identifier: Apache-2.0
// What the voxels of a grid are, by their edges. Only cubes are voxels of a level; others are resampled onto cubes
// (resample_volume.h).
#pragma once

#include <array>
#include <string>

#include "base/vec.h"

namespace farfield {

struct VoxelShape {
  bool is_singular = false;  ///< an edge has no length, or none that is a number, or they lie in a plane
  std::string other_shape;   ///< "2 x 1 x 1", "1 x 1 x 1, sheared"; empty: a cube
  double size = 0;           ///< of the cube; of other shapes, their shortest edge: of the cubes to resample onto
  glm::dmat3 rotation{1.0};  ///< columns, orthonormal: along the first edge, in the plane of the first two, upright to
                             ///< both, on the side of the third; may mirror
  glm::dmat3 edges{1.0};     ///< columns: the edges in the frame of `rotation`; upper triangular

  bool is_cube() const { return !is_singular && other_shape.empty(); }
};

/// The rotation is exactly the identity for edges along the axes.
VoxelShape voxel_shape(const std::array<dvec3, 3>& edges);

}  // namespace farfield
