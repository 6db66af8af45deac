// SPDX-License-Identifier: Apache-2.0
#include "base/vec.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

TEST(Box3, StartsEmptyAndGrows) {
  Box3 box;
  EXPECT_TRUE(box.is_empty());
  EXPECT_EQ(box.size(), vec3(0.0f));
  box.extend(vec3(1, 2, 3));
  EXPECT_FALSE(box.is_empty());
  box.extend(vec3(-1, 5, 3));
  EXPECT_EQ(box.size(), vec3(2, 3, 0));
  EXPECT_EQ(box.center(), vec3(0, 3.5f, 3));
}

TEST(Frame, IsOrthonormalEvenAtThePoles) {
  const vec3 directions[] = {{0, 0, 1}, {0, 0, -1}, {0, 0, -0.0f}, {1, 0, 0}, {1e-6f, 0, -1}, {0.6f, 0, -0.8f}};
  for (vec3 z : directions) {
    if (glm::length(z) == 0.0f) continue;
    z = glm::normalize(z);
    const Frame frame(z);
    EXPECT_NEAR(glm::dot(frame.x, frame.y), 0, 2e-6);
    EXPECT_NEAR(glm::dot(frame.x, z), 0, 2e-6);
    EXPECT_NEAR(glm::length(frame.x), 1, 2e-6);
    EXPECT_NEAR(glm::length(glm::cross(frame.x, frame.y) - z), 0, 2e-6);
    const vec3 v(0.3f, -2.0f, 0.7f);
    EXPECT_NEAR(glm::length(frame.to_world(frame.to_local(v)) - v), 0, 1e-5);
  }
}

}  // namespace
}  // namespace farfield
