// SPDX-License-Identifier: Apache-2.0
#include "prefilter/ray_scene.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <limits>

#include "base/just_behind.h"
#include "base/random.h"

namespace farfield {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

TEST(JustBehind, IsBeyondBoth) {
  for (const float near : {-1e30f, -1.0f, -FLT_MIN, 0.0f, FLT_MIN, 0.3f, 1e7f, 1e30f}) {
    for (const float distance : {-1e30f, -1.0f, -FLT_MIN, 0.0f, FLT_MIN, 0.3f, 1e7f, 1e30f}) {
      const float behind = just_behind(near, distance);
      EXPECT_GT(behind, near) << distance;
      EXPECT_GT(behind, distance) << near;
      EXPECT_GE(std::abs(behind), FLT_MIN) << near << " " << distance;
    }
  }
  EXPECT_EQ(just_behind(0, 0), FLT_MIN);
  EXPECT_EQ(just_behind(1, 2), std::nextafter(2.0f, 3.0f));
}

/// Triangles, of which rays pass all.
Surface nothing_but_gaps(int triangles) {
  Surface surface;
  Rng rng(1);
  const auto point = [&] { return vec3(rng.next(), rng.next(), rng.next()); };
  for (int i = 0; i < triangles; ++i) {
    const vec3 corner = point();
    const auto first = static_cast<uint32_t>(surface.positions.size());
    for (int k = 0; k < 3; ++k) surface.positions.push_back(corner + 0.4f * point());
    surface.triangles.push_back(uvec3(0, 1, 2) + first);
  }
  FaceMaterial gap;
  gap.opacity = 0;
  surface.materials.assign(surface.triangles.size(), gap);
  return surface;
}

// With 1 ulp from the last hit, one ray in some thousands met the same face for ever.
TEST(OpacityScene, RaysComeThroughWhatStopsNone) {
  const Surface gaps = nothing_but_gaps(40);
  const auto scene = OpacityScene::build(gaps);
  ASSERT_TRUE(scene) << scene.error().message;
  Rng rng(2);
  SplitMix random(3);
  const auto point = [&] { return vec3(rng.next(), rng.next(), rng.next()); };
  for (int i = 0; i < 100'000; ++i) {
    const vec3 from = point(), towards = glm::normalize(point() - from);
    EXPECT_FALSE(scene->first_stop(from, towards, kFar, random)) << i;
  }
}

}  // namespace
}  // namespace farfield
