// SPDX-License-Identifier: Apache-2.0
#include "bake/slab_hull.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "tests/support/random_unit.h"

namespace farfield {
namespace {

/// How far the points reach beyond the corners along a direction; <= 0 for every direction: they are inside.
float excess(const std::vector<vec3>& points, const std::vector<vec3>& corners, const vec3& direction) {
  float furthest_point = -INFINITY, furthest_corner = -INFINITY;
  for (const vec3& p : points) furthest_point = std::max(furthest_point, glm::dot(p, direction));
  for (const vec3& p : corners) furthest_corner = std::max(furthest_corner, glm::dot(p, direction));
  return furthest_point - furthest_corner;
}

std::vector<vec3> corners_of(const std::vector<vec3>& points) {
  SlabHull hull;
  for (const vec3& p : points) hull.add(p);
  return hull.corners();
}

void expect_contains(const std::vector<vec3>& points) {
  const std::vector<vec3> corners = corners_of(points);
  ASSERT_GE(corners.size(), 4u);
  EXPECT_LE(corners.size(), 150u);
  Rng rng(5);
  for (int i = 0; i < 500; ++i) EXPECT_LE(excess(points, corners, test::random_unit(rng)), 0);
}

TEST(SlabHull, ContainsRandomPointsInEveryDirection) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    std::vector<vec3> points;
    const vec3 stretch(1, std::pow(10.0f, -4 * rng.next()), std::pow(10.0f, -4 * rng.next()));
    for (int i = 0; i < 200; ++i) points.push_back(stretch * test::random_unit(rng) * rng.next());
    expect_contains(points);
  }
}

TEST(SlabHull, ContainsWhatIsFlatThinOrASinglePoint) {
  expect_contains({vec3(0)});
  expect_contains({vec3(3, -4, 1e6f)});
  expect_contains({vec3(0), vec3(1, 2, 3)});
  expect_contains({vec3(0), vec3(1, 0, 0), vec3(0, 1, 0), vec3(1, 1, 0)});
  expect_contains({vec3(1e7f, 1e7f, 1e7f), vec3(1e7f + 1, 1e7f, 1e7f + 5)});
  expect_contains({vec3(1e-20f, 0, 0), vec3(0, 1e-20f, 0)});
  expect_contains({vec3(1e30f, 0, 0), vec3(0, 1e30f, 0)});
}

TEST(SlabHull, IsTightAroundABall) {
  // Slabs 25 axes wide cut off nearly all of a box's corners: its widest reach is 12 % beyond a unit ball.
  Rng rng(1);
  std::vector<vec3> points;
  for (int i = 0; i < 20000; ++i) points.push_back(test::random_unit(rng));
  float furthest = 0;
  for (const vec3& corner : corners_of(points)) furthest = std::max(furthest, glm::length(corner));
  EXPECT_LT(furthest, 1.15f);
}

TEST(SlabHull, OfABoxIsTheBox) {
  SlabHull hull;
  hull.add(Box3{vec3(-1, -2, -3), vec3(1, 2, 3)});
  for (const vec3& corner : hull.corners()) {
    EXPECT_LE(std::abs(corner.x), 1.001f);
    EXPECT_LE(std::abs(corner.y), 2.001f);
    EXPECT_LE(std::abs(corner.z), 3.001f);
  }
}

TEST(SlabHull, OfNothingIsEmpty) {
  SlabHull hull;
  hull.add(Box3{});
  EXPECT_TRUE(hull.corners().empty());
}

}  // namespace
}  // namespace farfield
