// SPDX-License-Identifier: Apache-2.0
// Ellipsoids of attenuation as sources say them, and as voxels have them: matrices S of SGGX [Heitz et al. 2015] of any
// trace, or directions of fibres.
#pragma once

#include <array>

#include "base/vec.h"

namespace farfield {

/// Makes the diagonal >= 0 and correlations at most 1; whether it was not by more than rounding. The trace is above 0.
bool mend_ellipsoid(glm::dmat3& s);

/// Of flakes whose normals are upright to a fibre, roughly [Heitz et al. 2015, section 4.2]. direction: of any length
/// above 0. roughness: what is stopped along the fibre by what is stopped across it, in [0, 1].
glm::dmat3 fibre_ellipsoid(const dvec3& direction, double roughness);

/// Puts a matrix into a voxel whose sigma_t(w) is density sqrt(w^T s w): shape gets trace 1, and density takes the
/// rest.
void put_ellipsoid(const glm::dmat3& s, std::array<float, 6>& shape, float& density);

}  // namespace farfield
