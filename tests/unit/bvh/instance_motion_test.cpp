// SPDX-License-Identifier: Apache-2.0
#include "bvh/instance_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random_unit.h"

namespace farfield {
namespace {

mat4x3 turned(float degrees, const vec3& at = vec3(0.0f)) {
  const float a = glm::radians(degrees);
  return {vec3(std::cos(a), std::sin(a), 0), vec3(-std::sin(a), std::cos(a), 0), vec3(0, 0, 1), at};
}

mat4x3 scaled(const vec3& scale) { return {vec3(scale.x, 0, 0), vec3(0, scale.y, 0), vec3(0, 0, scale.z), vec3(0.0f)}; }

vec3 place_of(const InstanceRecord& record, const vec3& world) { return record.point_to_local(world); }

TEST(InstanceMotion, IsAtItsKeysAndGoesStraightBetween) {
  const std::vector<mat4x3> keys = {turned(0, {0, 0, 0}), turned(30, {1, 2, 0}), turned(0, {5, 2, 0})};
  const auto motion = InstanceMotion::make(keys);
  ASSERT_TRUE(motion);
  const InstanceRecord record = *make_instance(3, keys[0]);
  for (size_t i = 0; i < 3; ++i) {
    const InstanceRecord at_key = motion->at(record, 0.5f * static_cast<float>(i));
    EXPECT_EQ(at_key.world_to_local, make_instance(3, keys[i])->world_to_local) << i;
    EXPECT_EQ(at_key.asset, 3u);
  }
  for (const float t : {0.1f, 0.25f, 0.6f, 0.9f}) {
    const size_t key = t < 0.5f ? 0 : 1;
    const float u = 2.0f * t - static_cast<float>(key);
    const vec3 local(0.3f, -0.7f, 0.2f);
    const vec3 world = (1 - u) * (keys[key] * vec4(local, 1)) + u * (keys[key + 1] * vec4(local, 1));
    EXPECT_LT(glm::length(place_of(motion->at(record, t), world) - local), 1e-6f) << t;
  }
}

TEST(InstanceMotion, TimesOutsideAreItsEnds) {
  const std::vector<mat4x3> keys = {turned(0), turned(0, {5, 0, 0})};
  const auto motion = InstanceMotion::make(keys);
  const InstanceRecord record = *make_instance(0, keys[0]);
  for (const float before : {-1.0f, -0.0f, -INFINITY, std::numeric_limits<float>::quiet_NaN()})
    EXPECT_EQ(motion->at(record, before).world_to_local, record.world_to_local);
  for (const float after : {1.0f, 2.0f, INFINITY})
    EXPECT_EQ(motion->at(record, after).world_to_local, make_instance(0, keys[1])->world_to_local);
}

TEST(InstanceMotion, RefusesWaysThatSqueezeFlat) {
  const auto makes = [](const std::vector<mat4x3>& keys) { return InstanceMotion::make(keys).has_value(); };
  EXPECT_TRUE(makes({turned(0), turned(170)}));
  EXPECT_FALSE(makes({turned(0), turned(180)}));
  EXPECT_TRUE(makes({turned(0), turned(90), turned(180), turned(270), turned(360)}));
  EXPECT_FALSE(makes({scaled({1, 1, 1}), scaled({-1, 1, 1})}));   // to its mirror image
  EXPECT_FALSE(makes({scaled({1, 1, 1}), scaled({-1, -1, 1})}));  // the sign of the volume is the same at both ends
  EXPECT_FALSE(makes({scaled({2, 1, 1}), scaled({-1, -3, 1})}));  // flat twice on the way
  EXPECT_TRUE(makes({scaled({-1, 1, 1}), scaled({-2, 3, 1})}));
  EXPECT_TRUE(makes({scaled(vec3(1e-10f)), scaled(vec3(2e-10f))}));
  EXPECT_TRUE(makes({scaled(vec3(1e10f)), scaled(vec3(1e-10f))}));
  EXPECT_FALSE(makes({scaled({1, 1, 1}), scaled({1, 1, 0})}));
  EXPECT_FALSE(makes({turned(0), mat4x3(std::numeric_limits<float>::quiet_NaN())}));
  EXPECT_FALSE(makes({}));
  EXPECT_FALSE(makes({turned(0)}));
  EXPECT_TRUE(makes(std::vector<mat4x3>(129, turned(0))));
  EXPECT_FALSE(makes(std::vector<mat4x3>(130, turned(0))));
}

// The least volume is found where the cubic is level, not only at samples.
TEST(InstanceMotion, FlatnessAgreesWithFineSteps) {
  Rng rng(5);
  int refused = 0;
  for (int i = 0; i < 2000; ++i) {
    mat4x3 a, b;
    for (int column = 0; column < 3; ++column) a[column] = test::random_unit(rng), b[column] = test::random_unit(rng);
    a[3] = b[3] = vec3(0.0f);
    const glm::dmat3 start{glm::dvec3(a[0]), glm::dvec3(a[1]), glm::dvec3(a[2])};
    const glm::dmat3 end{glm::dvec3(b[0]), glm::dvec3(b[1]), glm::dvec3(b[2])};
    const double first = glm::determinant(start);
    double least = INFINITY;
    for (int k = 0; k <= 1000; ++k) {
      const double t = k / 1000.0;
      least = std::min(least, glm::determinant(start * (1 - t) + end * t) * (first < 0 ? -1 : 1));
    }
    const bool is_made = InstanceMotion::make(std::vector<mat4x3>{a, b}).has_value();
    refused += !is_made;
    if (std::abs(least) > 1e-3) {
      EXPECT_EQ(is_made, least > 0) << i << " " << least;
    }
  }
  EXPECT_GT(refused, 500);
  EXPECT_LT(refused, 1900);
}

}  // namespace
}  // namespace farfield
