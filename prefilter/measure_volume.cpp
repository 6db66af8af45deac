// SPDX-License-Identifier: Apache-2.0
#include "prefilter/measure_volume.h"

#include <algorithm>

#include "base/hash.h"
#include "prefilter/isotropic_lines.h"
#include "prefilter/line_scene.h"
#include "prefilter/match_sky.h"
#include "prefilter/self_shadowing.h"
#include "prefilter/thin_out.h"
#include "prefilter/visible_density.h"

namespace farfield {
namespace {

/// Share of the time up to the end of each step.
constexpr double kVoxelizeDone = 0.5, kMatchDone = 0.85, kEscapeDone = 0.95;

/// Lines per step: about half of rays_per_voxel through each voxel. Never more than an eighth of the rays of the
/// local measurement, as these are short; but a coarse level can afford enough for single voxels to show.
double line_count(const LineScene& scene, const SparseVolume& volume, uint32_t rays_per_voxel) {
  constexpr double kLeast = 2000, kMost = 1e9;
  const double voxels = static_cast<double>(volume.voxels.size());
  const double wanted = std::min(surface_area(scene.grid().box()) / 12, voxels / 8);
  return std::min(rays_per_voxel * std::max(wanted, kLeast), kMost);
}

}  // namespace

Result<SparseVolume> measure_volume(const Surface& geometry, const Surface& macrosurface, const VoxelLattice& lattice,
                                    const VolumeOptions& options) {
  const auto step = [&](double begin, double end) { return options.job.step("voxelise", begin, end); };
  VoxelizeOptions voxelize_options;
  voxelize_options.rays_per_voxel = options.rays_per_voxel - options.rays_per_voxel / 2;
  voxelize_options.seed = options.seed;
  voxelize_options.job = step(0, kVoxelizeDone);
  if (geometry.triangles.empty()) return voxelize(geometry, lattice, voxelize_options);
  FARFIELD_TRY_LET(const auto geometry_scene, OpacityScene::build(geometry));
  FARFIELD_TRY_LET(SparseVolume volume, voxelize(geometry_scene, lattice, voxelize_options));
  if (volume.voxels.empty()) return volume;

  FARFIELD_TRY_LET(const auto scene, LineScene::build(geometry_scene, macrosurface, volume));
  const double lines = line_count(scene, volume, options.rays_per_voxel);
  FARFIELD_TRY(match_visible_density(scene, volume, {lines, mix64(options.seed, 1), step(kVoxelizeDone, kMatchDone)}));
  FARFIELD_TRY(
      measure_self_shadowing(scene, volume, {lines / 2, mix64(options.seed, 2), step(kMatchDone, kEscapeDone)}));
  FARFIELD_TRY(match_sky(scene, volume, {mix64(options.seed, 3), step(kEscapeDone, 1)}));
  return thin_out(volume, options.seed);
}

}  // namespace farfield
