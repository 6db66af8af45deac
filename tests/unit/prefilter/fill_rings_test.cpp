// SPDX-License-Identifier: Apache-2.0
#include "prefilter/fill_rings.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "tests/support/polygons.h"

namespace farfield {
namespace {

using glm::dvec2;
using test::random_star;
using test::ring_of;

double area(const Filling& filling) {
  double sum = 0;
  for (const uvec3& t : filling.triangles) {
    const dvec2 u = filling.points[t.y] - filling.points[t.x], v = filling.points[t.z] - filling.points[t.x];
    EXPECT_GE(u.x * v.y - u.y * v.x, -1e-12);  // none turned over: so the sum being right means no overlap
    sum += 0.5 * (u.x * v.y - u.y * v.x);
  }
  return sum;
}

TEST(FillRings, AnySimplePolygonIsFilledExactlyOnceFromItsCorners) {
  std::mt19937 rng(1);
  for (int run = 0; run < 300; ++run) {
    const auto p = random_star(rng, 3 + run % 90);
    const Ring ring = ring_of(0, p.size());
    const Filling filling = fill_rings(p, {&ring, 1}, Winding::Positive);
    EXPECT_EQ(filling.points.size(), p.size()) << run;
    EXPECT_EQ(filling.triangles.size(), p.size() - 2) << run;
    EXPECT_NEAR(area(filling), 0.5 * twice_area(p, ring), 1e-12) << run;
  }
}

TEST(FillRings, HolesStayEmpty) {
  std::mt19937 rng(2);
  for (int run = 0; run < 200; ++run) {
    // An outline with radii of at least 2, and up to four holes at places that cannot meet each other.
    std::vector<dvec2> p = random_star(rng, 5 + run % 40, 1);
    for (dvec2& corner : p) corner += 2.5 * glm::normalize(corner);
    std::vector<Ring> rings = {ring_of(0, p.size())};
    double expected = twice_area(p, rings[0]);
    for (const dvec2 centre : {dvec2(1, 1), dvec2(-1, 0.3), dvec2(0.3, -1), dvec2(-0.9, -1.2)}) {
      if (static_cast<int>(rings.size()) > run % 5 + 1) break;
      const size_t begin = p.size();
      auto hole = random_star(rng, 3 + run % 7, 0.45);
      std::reverse(hole.begin(), hole.end());
      for (const dvec2& corner : hole) p.push_back(centre + corner);
      rings.push_back(ring_of(begin, p.size()));
      expected += twice_area(p, rings.back());
    }
    EXPECT_NEAR(2 * area(fill_rings(p, rings, Winding::Positive)), expected, 1e-10) << "run " << run;
  }
}

TEST(FillRings, CrossingsBecomePointsAndTheRuleSaysWhatIsInside) {
  // A bow tie: its right half goes round clockwise.
  const std::vector<dvec2> p = {{0, 0}, {2, 1}, {2, 0}, {0, 1}};
  const Ring ring = {0, 1, 2, 3};
  const Filling both = fill_rings(p, {&ring, 1}, Winding::Nonzero), one = fill_rings(p, {&ring, 1}, Winding::Positive);
  EXPECT_NEAR(area(both), 1.0, 1e-12);
  EXPECT_NEAR(area(one), 0.5, 1e-12);
  ASSERT_EQ(both.points.size(), 5u);
  EXPECT_NEAR(glm::length(both.points[4] - dvec2(1, 0.5)), 0, 1e-12);
  ASSERT_EQ(both.nearest.size(), 1u);
  EXPECT_LT(both.nearest[0], 4u);
}

TEST(FillRings, PointsInTheMiddleOfStraightEdgesStayCorners) {
  const std::vector<dvec2> p = {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};
  const Ring ring = ring_of(0, p.size());
  const Filling filling = fill_rings(p, {&ring, 1}, Winding::Positive);
  std::set<uint32_t> used;
  for (const uvec3& t : filling.triangles) used.insert({t.x, t.y, t.z});
  EXPECT_EQ(used.size(), p.size());
  EXPECT_NEAR(area(filling), 4, 1e-12);
}

TEST(FillRings, NothingAndLinesGiveNothing) {
  EXPECT_TRUE(fill_rings({}, {}, Winding::Positive).triangles.empty());
  const std::vector<dvec2> line = {{0, 0}, {1, 1}, {2, 2}, {3, 3}};
  const std::vector<Ring> rings = {{0, 1}, {0, 1, 2, 3}};
  EXPECT_TRUE(fill_rings(line, rings, Winding::Nonzero).triangles.empty());
}

// Ear clipping took a time cubic in the edges here. Not a timed test: it would not end.
TEST(FillRings, AHundredThousandEdgesThatTouchThemselvesAreFilled) {
  // A comb whose teeth meet in points of its back.
  std::vector<dvec2> p;
  Ring ring;
  constexpr int kTeeth = 50000;
  p.emplace_back(0, -1);
  p.emplace_back(kTeeth, -1);
  for (int i = kTeeth; i > 0; --i) {
    p.emplace_back(i, 0);
    p.emplace_back(i - 0.5, i % 3 == 0 ? -1 : 1);
  }
  p.emplace_back(0, 0);
  ring = ring_of(0, p.size());
  const Filling filling = fill_rings(p, {&ring, 1}, Winding::Positive);
  EXPECT_NEAR(area(filling), 0.5 * twice_area(p, ring), 1e-6 * kTeeth);
}

}  // namespace
}  // namespace farfield
