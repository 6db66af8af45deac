// SPDX-License-Identifier: Apache-2.0
#include "prefilter/simplify.h"

#include <gtest/gtest.h>

#include "test_surfaces.h"

namespace farfield {
namespace {

using namespace test;

TEST(Simplify, KeepsTheAreaOfAPlane) {
  const Surface plane = make_plane(40, 40, 1.0f, 1.0f);
  const SimplifyResult result = simplify(plane, {.resolution = 0.2f});
  EXPECT_NEAR(total_area(result.surface), 1.0, 1e-4);
  EXPECT_LT(result.surface.triangles.size(), 1000u);
}

}  // namespace
}  // namespace farfield
