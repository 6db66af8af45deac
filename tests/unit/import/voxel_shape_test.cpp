// SPDX-License-Identifier: Apache-2.0
#include "import/voxel_shape.h"

#include <gtest/gtest.h>

#include <cmath>

namespace farfield {
namespace {

TEST(VoxelShape, OfEdgesAlongTheAxesIsExact) {
  for (const double size : {0.5, 0.05, 1.0, 3e-7, 1e9}) {
    const VoxelShape shape = voxel_shape({dvec3(size, 0, 0), dvec3(0, size, 0), dvec3(0, 0, size)});
    EXPECT_TRUE(shape.is_cube());
    EXPECT_EQ(shape.size, size);
    EXPECT_EQ(shape.rotation, glm::dmat3(1.0));
  }
}

TEST(VoxelShape, KeepsTurnsAndMirrors) {
  const double c = 2 * std::cos(0.3), s = 2 * std::sin(0.3);
  for (const double side : {1.0, -1.0}) {
    const VoxelShape shape = voxel_shape({dvec3(c, s, 0), dvec3(-s, c, 0), dvec3(0, 0, side * 2.00001)});
    EXPECT_TRUE(shape.is_cube());
    EXPECT_NEAR(shape.size, 2, 1e-5);
    EXPECT_NEAR(glm::determinant(shape.rotation), side, 1e-12);
    EXPECT_NEAR(shape.rotation[0].y, std::sin(0.3), 1e-12);
  }
}

TEST(VoxelShape, SaysWhatIsNoCube) {
  EXPECT_EQ(voxel_shape({dvec3(2, 0, 0), dvec3(0, 1, 0), dvec3(0, 0, 1)}).other_shape, "2 x 1 x 1");
  EXPECT_EQ(voxel_shape({dvec3(2, 0, 0), dvec3(0, 1, 0), dvec3(0, 0, 1)}).size, 1.0);
  const VoxelShape sheared = voxel_shape({dvec3(0, 0, 1), dvec3(0, -0.8, 0.6), dvec3(2, 0, 0)});
  EXPECT_EQ(sheared.other_shape, "1 x 1 x 2, sheared");
  for (int axis = 0; axis < 3; ++axis) {
    const std::array<dvec3, 3> edges = {dvec3(0, 0, 1), dvec3(0, -0.8, 0.6), dvec3(2, 0, 0)};
    EXPECT_LT(glm::distance(sheared.rotation * sheared.edges[axis], edges[static_cast<size_t>(axis)]), 1e-14);
    for (int row = axis + 1; row < 3; ++row) EXPECT_EQ(sheared.edges[axis][row], 0.0);
  }
  EXPECT_TRUE(voxel_shape({dvec3(1, 0, 0), dvec3(1, 1, 0), dvec3(0, 1, 0)}).is_singular);
  EXPECT_TRUE(voxel_shape({dvec3(1, 0, 0), dvec3(0.0), dvec3(0, 0, 1)}).is_singular);
  EXPECT_TRUE(voxel_shape({dvec3(NAN, 0, 0), dvec3(0, 1, 0), dvec3(0, 0, 1)}).is_singular);
  EXPECT_FALSE(voxel_shape({dvec3(INFINITY, 0, 0), dvec3(0, 1, 0), dvec3(0, 0, 1)}).is_cube());
}

}  // namespace
}  // namespace farfield
