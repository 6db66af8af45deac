// SPDX-License-Identifier: Apache-2.0
// From how often rays hit to how dense the volume must be (thesis 9.3.1; docs/theory.md, section 7).
#pragma once

#include <cstdint>

#include "base/vec.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// Density times length is never more than this: nothing is seen through it, and a planar S has no finite solution that
/// would be more opaque in its own plane.
inline constexpr double kMaxDensityLength = 400;

/// Optical depth tau = -log(1 - hits / rays) of rays that hit something `hits` times: unbiased for the transmittance
/// over the rays' length. All hit: as if half a ray had passed, so at most log(2 rays). rays > 0, hits <= rays.
double optical_depth_of_hits(uint32_t hits, uint32_t rays);

/// Mean over all directions w of exp(-density length sqrt(w^T S w)), as 1 - result, which keeps its digits for thin
/// media. density, length >= 0. Pure. Relative error below 1e-5 for sqrt(lambda_max) density length <= 30:
/// docs/theory.md, section 7.3.
double mean_opacity(const SymMat3& s, double density, double length);

/// The density rho >= 0 of an SGGX microflake medium that lets exp(-optical_depth) through over `length`, averaged over
/// directions. s: PSD, any scale, not 0 unless optical_depth is 0; length > 0, in scene units; the result is in 1 /
/// scene units for this scale of s. Capped at kMaxDensityLength / (length sqrt(lambda_max)). Pure; any thread.
double solve_density(const SymMat3& s, double optical_depth, double length);

}  // namespace farfield
