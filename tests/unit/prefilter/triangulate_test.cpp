// SPDX-License-Identifier: Apache-2.0
#include "prefilter/triangulate.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "tests/support/polygons.h"

namespace farfield {
namespace {

using glm::dvec2;
using test::random_star;
using test::ring_of;

dvec3 area_vector(const std::vector<dvec3>& p, const uvec3& t) {
  return 0.5 * glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]);
}

TEST(Triangulate, PolygonInSpaceKeepsItsWindingAndArea) {
  std::mt19937 rng(3);
  const dvec3 x = glm::normalize(dvec3(1, 2, -0.5)), z = glm::normalize(glm::cross(x, dvec3(0, 0, 1)));
  const dvec3 y = glm::cross(z, x);
  for (int run = 0; run < 50; ++run) {
    const auto flat = random_star(rng, 5 + run);
    std::vector<dvec3> p;
    for (const dvec2& c : flat) p.push_back(dvec3(1e7, -1e7, 3e6) + c.x * x + c.y * y);  // also far away
    dvec3 sum(0.0);
    for (const uvec3& t : triangulate_polygon(p)) {
      EXPECT_GE(glm::dot(area_vector(p, t), z), -1e-12);
      sum += area_vector(p, t);
    }
    const double expected = 0.5 * twice_area(flat, ring_of(0, flat.size()));
    EXPECT_NEAR(glm::dot(sum, z), expected, 1e-7);
  }
}

TEST(Triangulate, CollinearCornersStayCornersOfTriangles) {
  // A square with extra corners on its sides: dropping them would leave T-junctions at the neighbours.
  const std::vector<dvec3> p = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {2, 2, 0}, {1, 2, 0}, {0, 2, 0}, {0, 1, 0}};
  std::map<uint32_t, int> used;
  double sum = 0;
  for (const uvec3& t : triangulate_polygon(p)) {
    sum += area_vector(p, t).z;
    for (int k = 0; k < 3; ++k) ++used[t[k]];
  }
  EXPECT_NEAR(sum, 4, 1e-12);
  EXPECT_EQ(used.size(), p.size());
}

TEST(Triangulate, ConcaveQuadIsCutInsideWhereverItStarts) {
  const std::vector<dvec3> arrow = {{0, 0, 0}, {1, 0, 0}, {0.2, 0.2, 0}, {0, 1, 0}};
  for (size_t start = 0; start < 4; ++start) {
    std::vector<dvec3> p;
    for (size_t i = 0; i < 4; ++i) p.push_back(arrow[(start + i) % 4]);
    for (const bool reversed : {false, true}) {
      if (reversed) std::reverse(p.begin(), p.end());
      double sum = 0;
      for (const uvec3& t : triangulate_polygon(p)) sum += glm::length(area_vector(p, t));
      EXPECT_NEAR(sum, 0.2, 1e-12);
    }
  }
}

TEST(Triangulate, RectangleIsCutTheSameWayWhereverItStartsAndWhicheverWayRound) {
  const std::vector<dvec3> rectangle = {{1, 1, 0}, {2, 1, 0}, {2, 4, 0}, {1, 4, 0}};
  for (size_t start = 0; start < 4; ++start) {
    for (const bool reversed : {false, true}) {
      std::vector<dvec3> p;
      for (size_t i = 0; i < 4; ++i) p.push_back(rectangle[(start + i) % 4]);
      if (reversed) std::reverse(p.begin(), p.end());
      const auto triangles = triangulate_polygon(p);
      ASSERT_EQ(triangles.size(), 2u);
      int at_smallest = 0;  // both triangles touch (1, 1): the diagonal starts there
      for (const uvec3& t : triangles) {
        for (int k = 0; k < 3; ++k) at_smallest += p[t[k]] == rectangle[0];
      }
      EXPECT_EQ(at_smallest, 2);
    }
  }
}

TEST(Triangulate, WhatIsNoPolygonGivesNothing) {
  EXPECT_TRUE(triangulate_polygon({}).empty());
  const std::vector<dvec3> two = {{0, 0, 0}, {1, 0, 0}};
  EXPECT_TRUE(triangulate_polygon(two).empty());
  const std::vector<dvec3> nan = {{0, 0, 0}, {1, 0, 0}, {0, std::nan(""), 0}};
  EXPECT_TRUE(triangulate_polygon(nan).empty());
  const std::vector<dvec3> line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  EXPECT_TRUE(triangulate_polygon(line).empty());
  EXPECT_TRUE(triangulate_polygon(std::vector<dvec3>(30000)).empty());
}

TEST(Triangulate, PolygonsThatCrossThemselvesAreFilledWithTheirOwnCorners) {
  std::mt19937 rng(4);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int run = 0; run < 100; ++run) {
    std::vector<dvec3> p(5 + static_cast<size_t>(run));
    for (dvec3& corner : p) corner = dvec3(any(rng), any(rng), 0.1 * any(rng));
    const auto triangles = triangulate_polygon(p);
    EXPECT_FALSE(triangles.empty());
    for (const uvec3& t : triangles) {
      EXPECT_TRUE(t.x < p.size() && t.y < p.size() && t.z < p.size());
      EXPECT_TRUE(t.x != t.y && t.y != t.z && t.z != t.x);
    }
  }
}

}  // namespace
}  // namespace farfield
