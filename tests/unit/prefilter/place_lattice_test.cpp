// SPDX-License-Identifier: Apache-2.0
#include "prefilter/place_lattice.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using test::join;

constexpr double kSize = 0.25;
constexpr double kChance = 0.03;  ///< of a voxel: what 16384 points leave, and more

Surface moved(Surface surface, const vec3& by) {
  for (vec3& position : surface.positions) position += by;
  return surface;
}

Surface deck_at(float z) { return moved(test::make_plane(3, 3, 2.7f, 1.9f), {0, 0, z}); }

/// Where in its voxel a coordinate is, in [0, 1).
double place_in_voxel(const VoxelLattice& lattice, int axis, double coordinate) {
  const double x = (coordinate - lattice.origin[axis]) / lattice.voxel_size;
  return x - std::floor(x);
}

TEST(PlaceLattice, ADeckIsInTheMiddleOfVoxels) {
  for (const float z : {0.0f, 0.1f, 0.125f, 0.2f, -3.3f}) {
    const VoxelLattice lattice = place_lattice(deck_at(z), dvec3(0), kSize);
    EXPECT_NEAR(place_in_voxel(lattice, 2, static_cast<double>(z)), 0.5, kChance) << z;
    EXPECT_EQ(lattice.voxel_size, kSize);
  }
}

TEST(PlaceLattice, TheOriginIsWithinHalfAVoxelOfTheMiddle) {
  const dvec3 middle(1, -2, 3);
  for (const float z : {0.0f, 0.06f, 0.12f, 0.18f, 0.24f}) {
    const dvec3 origin = place_lattice(deck_at(z), middle, kSize).origin;
    for (int axis = 0; axis < 3; ++axis) EXPECT_LE(std::abs(origin[axis] - middle[axis]), 0.5 * kSize) << z;
  }
}

TEST(PlaceLattice, DecksWholeVoxelsApartAreAllInMiddles) {
  const VoxelLattice lattice = place_lattice(join(deck_at(0.07f), deck_at(0.07f + 3 * 0.25f)), dvec3(0), kSize);
  EXPECT_NEAR(place_in_voxel(lattice, 2, 0.07), 0.5, kChance);
}

TEST(PlaceLattice, ATrunkDecidesForItsCrown) {
  const Surface crown = test::leaf_cloud({});
  const Surface trunk = moved(test::make_tube(8, 4, 0.02f, 1.0f), {0.53f, 0.47f, 0});
  ASSERT_GT(test::total_area(crown), 5 * test::total_area(trunk));
  const VoxelLattice lattice = place_lattice(join(crown, trunk), dvec3(0), 0.1);
  EXPECT_NEAR(place_in_voxel(lattice, 0, 0.53), 0.5, 0.1);
  EXPECT_NEAR(place_in_voxel(lattice, 1, 0.47), 0.5, 0.1);
}

TEST(PlaceLattice, WhatStopsNoRayDoesNotCount) {
  Surface glass = deck_at(0.2f);
  for (FaceMaterial& material : glass.materials) material.opacity = 0;
  const VoxelLattice lattice = place_lattice(join(glass, deck_at(0.07f)), dvec3(0), kSize);
  EXPECT_NEAR(place_in_voxel(lattice, 2, 0.07), 0.5, kChance);
}

TEST(PlaceLattice, WithoutAreaAVoxelIsInTheMiddle) {
  Surface line = deck_at(0);
  for (vec3& position : line.positions) position.y = 0;
  for (const Surface& surface : {Surface{}, line}) {
    const VoxelLattice lattice = place_lattice(surface, dvec3(1), kSize);
    for (int axis = 0; axis < 3; ++axis) EXPECT_DOUBLE_EQ(place_in_voxel(lattice, axis, 1), 0.5);
  }
}

}  // namespace
}  // namespace farfield
