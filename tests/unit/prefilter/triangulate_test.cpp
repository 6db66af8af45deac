// SPDX-License-Identifier: Apache-2.0
#include "prefilter/triangulate.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "prefilter/ear_clipping.h"

namespace farfield {
namespace {

using glm::dvec2;

dvec3 area_vector(const std::vector<dvec3>& p, const uvec3& t) {
  return 0.5 * glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]);
}

double area_2d(const std::vector<dvec2>& p, const uvec3& t) {
  const dvec2 u = p[t.y] - p[t.x], v = p[t.z] - p[t.x];
  return 0.5 * (u.x * v.y - u.y * v.x);
}

/// A star-shaped polygon with random radii: simple, and concave at about half its corners.
std::vector<dvec2> random_star(std::mt19937& rng, int corners, double scale = 1) {
  std::uniform_real_distribution<double> radius(0.2, 1.0);
  std::vector<dvec2> p;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * 3.14159265358979 * i / corners;
    p.push_back(scale * radius(rng) * dvec2(std::cos(angle), std::sin(angle)));
  }
  return p;
}

Ring ring_of(size_t begin, size_t end) {
  Ring ring;
  for (size_t i = begin; i < end; ++i) ring.push_back(static_cast<uint32_t>(i));
  return ring;
}

TEST(Triangulate, EarsOfAnyPolygonFillItsAreaExactlyOnce) {
  std::mt19937 rng(1);
  for (int run = 0; run < 300; ++run) {
    const auto p = random_star(rng, 3 + run % 90);
    const Ring ring = ring_of(0, p.size());
    const auto triangles = clip_ears(p, ring);
    ASSERT_EQ(triangles.size(), p.size() - 2);
    double sum = 0;
    for (const uvec3& t : triangles) {
      ASSERT_GE(area_2d(p, t), 0) << "run " << run;  // none turned over: so the sum being right means no overlap
      sum += area_2d(p, t);
    }
    EXPECT_NEAR(sum, 0.5 * twice_area(p, ring), 1e-12);
  }
}

TEST(Triangulate, HolesStayEmpty) {
  std::mt19937 rng(2);
  for (int run = 0; run < 200; ++run) {
    // An outline with radii of at least 2, and up to four holes at places that cannot meet each other.
    std::vector<dvec2> p = random_star(rng, 5 + run % 40, 1);
    for (dvec2& corner : p) corner += 2.5 * glm::normalize(corner);
    const Ring outer = ring_of(0, p.size());
    double expected = twice_area(p, outer);
    std::vector<Ring> holes;
    for (const dvec2 centre : {dvec2(1, 1), dvec2(-1, 0.3), dvec2(0.3, -1), dvec2(-0.9, -1.2)}) {
      if (static_cast<int>(holes.size()) > run % 5) break;
      const size_t begin = p.size();
      auto hole = random_star(rng, 3 + run % 7, 0.45);
      std::reverse(hole.begin(), hole.end());
      for (const dvec2& corner : hole) p.push_back(centre + corner);
      holes.push_back(ring_of(begin, p.size()));
      expected += twice_area(p, holes.back());
    }
    double sum = 0;
    for (const uvec3& t : clip_ears(p, join_holes(p, outer, holes))) {
      ASSERT_GE(area_2d(p, t), -1e-12) << "run " << run;
      sum += 2 * area_2d(p, t);
    }
    EXPECT_NEAR(sum, expected, 1e-10) << "run " << run;
  }
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
  EXPECT_TRUE(triangulate_polygon(std::vector<dvec3>(kMaxPolygonCorners + 1)).empty());
}

TEST(Triangulate, PolygonThatCrossesItselfStillEnds) {
  std::mt19937 rng(4);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int run = 0; run < 100; ++run) {
    std::vector<dvec2> p(5 + static_cast<size_t>(run));
    for (dvec2& corner : p) corner = dvec2(any(rng), any(rng));
    EXPECT_EQ(clip_ears(p, ring_of(0, p.size())).size(), p.size() - 2);
  }
}

}  // namespace
}  // namespace farfield
