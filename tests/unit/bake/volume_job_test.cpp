// SPDX-License-Identifier: Apache-2.0
#include "bake/volume_job.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/surfaces.h"

namespace farfield {
namespace {

TEST(VolumeJob, IsNamedByAllThatItsResultDependsOn) {
  const Surface leaves = test::leaf_cloud({});
  Surface moved = leaves, recoloured = leaves, rewired = leaves;
  moved.positions[0].x += 1e-3f;
  recoloured.materials[0].diffuse.y += 0.1f;
  std::swap(rewired.triangles[0].x, rewired.triangles[0].y);
  const Surface none;
  const VoxelLattice lattice{dvec3(0), 1.0 / 16};
  const VolumeOptions options;

  std::set<std::string> names = {VolumeJob{leaves, none, lattice, options}.file_name()};
  const auto add = [&](const VolumeJob& job) { return names.insert(job.file_name()).second; };
  EXPECT_FALSE(add({leaves, none, lattice, options}));
  VolumeOptions observed = options;
  observed.job.progress = [](double, const std::string&) {};
  EXPECT_FALSE(add({leaves, none, lattice, observed}));
  EXPECT_TRUE(add({moved, none, lattice, options}) && add({recoloured, none, lattice, options}) &&
              add({rewired, none, lattice, options}));
  EXPECT_TRUE(add({leaves, none, {dvec3(0, 1, 0), 1.0 / 16}, options}) &&
              add({leaves, none, {dvec3(0), 1.0 / 8}, options}));
  EXPECT_TRUE(add({leaves, none, lattice, {.rays_per_voxel = 201}}) && add({leaves, none, lattice, {.seed = 1}}));
  EXPECT_TRUE(add({leaves, leaves, lattice, options}) && add({leaves, moved, lattice, options}));
}

}  // namespace
}  // namespace farfield
