// SPDX-License-Identifier: Apache-2.0
// How much of the light that a voxel's geometry scatters gets away, compared with what its medium would let away
// (after thesis 14.1.4, algorithm Iso; docs/decisions/0010), and how that depends on where it is seen from (0017) and
// from which side (0019).
#pragma once

#include <cstdint>

#include "base/job.h"
#include "base/result.h"
#include "prefilter/line_scene.h"
#include "prefilter/voxelize.h"

namespace farfield {

/// Bounds of what one voxel's geometry lets away, by what its medium does. A resolved surface that becomes a medium
/// loses half of what it scatters once, so nothing needs more than 2.
inline constexpr double kLeastEscape = 0.02, kMostEscape = 2;

/// Makes as much light get away from a voxel's medium as does from its geometry, `ratio` times as much as now (within
/// the bounds above): less by self-shadowing A = ratio, more by a higher albedo. White stays white.
void let_escape(double ratio, Voxel& voxel);

/// Bounds of how much more a geometry lets through, by what its medium does.
inline constexpr double kLeastThrough = 0.25, kMostThrough = 4;

/// Multiplies the odds of light to go through the voxel's flakes instead of back; they absorb as much as before.
void let_through(double ratio, Voxel& voxel);

/// Multiplies the odds of light of each channel to be reflected or let through by the voxel's base. ratio > 0.
void recolor(const vec3& ratio, Voxel& voxel);

/// Bounds of how much more of its highlights a geometry lets away, by what its medium does.
inline constexpr double kLeastGlance = 0.5, kMostGlance = 2;

/// Multiplies the odds of light to be reflected by the voxel's highlight, in the mean over all directions, by a
/// brighter or darker F0.
void let_glance(double ratio, Voxel& voxel);

struct SelfShadowingOptions {
  double lines = 0;
  uint64_t seed = 0;
  Job job{};  ///< reports from the calling thread alone
};

/// Sets self_shadowing, the hot spot, the highlight's lean and the open side and corrects albedos, for the densities
/// that the volume has. Light goes on from what isotropic lines see first, in the geometry and in the medium, until it
/// is out of both. The result does not depend on the number of threads. Errors: Cancelled.
Result<void> measure_self_shadowing(const LineScene& scene, SparseVolume& volume, const SelfShadowingOptions& options);

}  // namespace farfield
