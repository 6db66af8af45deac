// SPDX-License-Identifier: Apache-2.0
#include "prefilter/macrosurface.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "test_surfaces.h"

namespace farfield {
namespace {

using namespace test;

double macrosurface_part(const Surface& surface, float resolution) {
  const std::vector<uint8_t> classes = classify_macrosurface(surface, resolution);
  return static_cast<double>(std::count(classes.begin(), classes.end(), 1)) / static_cast<double>(classes.size());
}

TEST(Macrosurface, ASphereIsOneWhileTheResolutionIsSmallerThanItsRadius) {
  const Surface sphere = make_sphere(48, 24, 1.0f);
  for (const float resolution : {0.02f, 0.1f, 0.3f, 0.9f}) EXPECT_EQ(macrosurface_part(sphere, resolution), 1.0);
  for (const float resolution : {1.01f, 1.5f, 2.1f, 100.0f}) EXPECT_EQ(macrosurface_part(sphere, resolution), 0.0);
}

TEST(Macrosurface, AThinTubeIsNone) {
  const Surface tube = make_tube(12, 200, 0.02f, 4.0f);
  EXPECT_EQ(macrosurface_part(tube, 0.1f), 0.0);
  EXPECT_EQ(macrosurface_part(tube, 0.005f), 1.0);
}

}  // namespace
}  // namespace farfield
