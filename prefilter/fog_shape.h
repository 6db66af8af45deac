// SPDX-License-Identifier: Apache-2.0
// Ellipsoids of attenuation of a source's voxels, where it has any: sigma_t(w) = density sqrt(w^T S w).
#pragma once

#include <algorithm>
#include <cmath>

#include "import/source_volume.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// sqrt(w^T S w).
inline double shape_sigma(const SymMat3& s, const dvec3& w) {
  return std::sqrt(std::max(0.0, static_cast<double>(s.quadratic(vec3(w)))));
}

/// S of a voxel; the grid has shapes.
inline SymMat3 source_shape(const DensityGrid& grid, uint32_t brick, size_t voxel) {
  const auto& s = grid.shapes[brick][voxel];
  return {s[0], s[1], s[2], s[3], s[4], s[5]};
}

/// What a voxel's density is multiplied with towards w; 1 without shapes.
inline double source_sigma(const DensityGrid& grid, uint32_t brick, size_t voxel, const dvec3& w) {
  return grid.shapes.empty() ? 1.0 : shape_sigma(source_shape(grid, brick, voxel), w);
}

/// Whether albedos of all that voxels scatter differ from voxel to voxel.
inline bool has_own_albedos(const SourceVolume& source) {
  return !source.albedos.empty() || !source.self_shadowing.empty();
}

}  // namespace farfield
