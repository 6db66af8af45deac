// SPDX-License-Identifier: Apache-2.0
#include "prefilter/surface.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

TEST(Surface, BoundsIgnoreVerticesThatNoFaceUses) {
  Surface surface;
  surface.positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {1e6f, 0, 0}};
  surface.triangles = {{0, 1, 2}};
  EXPECT_EQ(surface.bounds().lower, vec3(0, 0, 0));
  EXPECT_EQ(surface.bounds().upper, vec3(1, 2, 0));
}

TEST(Surface, EmptySurfaceHasEmptyBounds) { EXPECT_TRUE(Surface().bounds().is_empty()); }

}  // namespace
}  // namespace farfield
