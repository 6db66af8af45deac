// SPDX-License-Identifier: Apache-2.0
#include "prefilter/vertex_placement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>

namespace farfield {
namespace {

double squared(const dvec3& v) { return glm::dot(v, v); }

dvec3 random_point(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  return {normal(rng), normal(rng), normal(rng)};
}

/// Edge ab in the middle of a triangular grid with unit edges, lifted to a height field.
CollapseRing grid_ring(const std::function<double(double, double)>& height) {
  const auto at = [&](double u, double v) {
    const double x = u + 0.5 * v, y = 0.5 * std::sqrt(3.0) * v;
    return dvec3(x, y, height(x, y));
  };
  const dvec3 a = at(0, 0), b = at(1, 0);
  const std::array<dvec3, 8> outline = {at(2, 0),  at(1, 1),  at(0, 1),  at(-1, 1),
                                        at(-1, 0), at(0, -1), at(1, -1), at(2, -1)};
  CollapseRing ring;
  for (size_t i = 0; i < 8; ++i) {
    const dvec3 &q = outline[i], &s = outline[(i + 1) % 8];
    ring.before.push_back({i >= 2 && i < 6 ? a : b, q, s});
    ring.after.push_back({q, s});
    ring.samples_before.push_back(0.5 * ((i >= 2 && i <= 6 ? a : b) + q));
    ring.neighbours_after.push_back(q);
  }
  ring.before.push_back({b, outline[2], a});
  ring.before.push_back({a, outline[6], b});
  ring.samples_before.insert(ring.samples_before.end(), {a, b});
  return ring;
}

double area_after(const CollapseRing& ring, const dvec3& x) {
  double area = 0;
  for (const auto& [q, s] : ring.after) area += 0.5 * glm::length(glm::cross(q - x, s - x));
  return area;
}

double area_before(const CollapseRing& ring) {
  double area = 0;
  for (const BoundedTriangle& t : ring.before) area += 0.5 * glm::length(area_vector(t.corners));
  return area;
}

/// The largest distance, and what one step of closest_position() gives, by looking at every triangle.
struct LookedAtAll {
  double deviation = 0;
  dvec3 next;
};

LookedAtAll look_at_all(const CollapseRing& ring, const dvec3& x) {
  LookedAtAll result;
  dvec3 moment(0.0);
  double weight2 = 0;
  const auto add = [&](double weight, const dvec3& rest, const dvec3& target) {
    result.deviation = std::max(result.deviation, glm::length(weight * x + rest - target));
    weight2 += weight * weight;
    moment += weight * (target - rest);
  };
  const auto farther = [](const dvec3& p) {
    return [p](const dvec3& l, const dvec3& r) { return squared(l - p) < squared(r - p); };
  };
  for (const dvec3& p : ring.samples_before) {
    std::vector<dvec3> points, weights;
    for (const auto& [q, s] : ring.after) {
      weights.push_back(closest_barycentric(p, x, q, s));
      points.push_back(weights.back().x * x + (weights.back().y * q + weights.back().z * s));
    }
    const size_t i = static_cast<size_t>(std::ranges::min_element(points, farther(p)) - points.begin());
    add(weights[i].x, weights[i].y * ring.after[i][0] + weights[i].z * ring.after[i][1], p);
  }
  const auto add_after = [&](double weight, const dvec3& rest) {
    std::vector<dvec3> points;
    for (const BoundedTriangle& t : ring.before) {
      const auto& [a, b, c] = t.corners;
      const dvec3 bary = closest_barycentric(weight * x + rest, a, b, c);
      points.push_back(bary.x * a + bary.y * b + bary.z * c);
    }
    add(weight, rest, *std::ranges::min_element(points, farther(weight * x + rest)));
  };
  add_after(1.0, dvec3(0.0));
  for (const dvec3& q : ring.neighbours_after) add_after(0.5, 0.5 * q);
  result.next = moment / weight2;
  return result;
}

TEST(VertexPlacement, FindsWhatLookingAtEveryTriangleFinds) {
  std::mt19937 rng(4);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 500; ++round) {
    const double roughness = std::pow(10.0, -4.0 + round % 6);  // from nearly flat to a tangle
    CollapseRing ring = grid_ring([&](double, double) { return roughness * normal(rng); });
    if (round % 3 == 1) {  // slivers: the ring is squeezed to a line, or nearly
      const double width = round % 2 == 0 ? 0.0 : 1e-7;
      for (auto& t : ring.before) {
        for (dvec3& p : t.corners) p.y *= width;
        t = {t.corners[0], t.corners[1], t.corners[2]};
      }
      for (auto& t : ring.after) t[0].y *= width, t[1].y *= width;
    }
    if (round % 5 == 0) ring.after[1] = {ring.after[1][0], ring.after[1][0]};
    const dvec3 x = dvec3(0.5, 0.0, 0.0) + 0.3 * roughness * random_point(rng);
    const LookedAtAll expected = look_at_all(ring, x);
    EXPECT_NEAR(deviation_at(ring, x), expected.deviation, 1e-12 * (1 + roughness)) << round;
    const double one_step = 1e9;
    EXPECT_LT(glm::length(closest_position(ring, x, one_step) - expected.next), 1e-12 * (1 + roughness)) << round;
  }
}

TEST(VertexPlacement, FarFromTheOriginItFindsTheSame) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> u;
  const dvec3 offset(1e7, -3e7, 1e7);
  for (int round = 0; round < 600; ++round) {
    const double edge = round % 2 == 0 ? 1.0 : std::exp2(-28 - 4 * u(rng));  // one to a few steps of a double there
    const auto moved = [&](const dvec3& p) { return offset + edge * p; };
    CollapseRing ring = grid_ring([&](double, double) { return 0.3 * u(rng); });
    for (auto& t : ring.before) t = {moved(t.corners[0]), moved(t.corners[1]), moved(t.corners[2])};
    for (auto& t : ring.after) t = {moved(t[0]), moved(t[1])};
    for (dvec3& p : ring.samples_before) p = moved(p);
    for (dvec3& p : ring.neighbours_after) p = moved(p);
    const dvec3 x = moved({0.5, 0.0, 0.3 * u(rng)});
    const LookedAtAll expected = look_at_all(ring, x);
    EXPECT_NEAR(deviation_at(ring, x), expected.deviation, 1e-10) << round;
    EXPECT_LT(glm::length(closest_position(ring, x, 1e9) - expected.next), 1e-10) << round;
  }
}

TEST(VertexPlacement, WithoutFacesNothingIsNear) {
  CollapseRing ring = grid_ring([](double, double) { return 0.0; });
  ring.after.clear();
  EXPECT_EQ(deviation_at(ring, dvec3(0.0)), std::numeric_limits<double>::infinity());
  EXPECT_EQ(closest_position(ring, {1, 2, 3}, 1e-6), dvec3(1, 2, 3));
  ring = grid_ring([](double, double) { return 0.0; });
  ring.before.clear();
  EXPECT_EQ(deviation_at(ring, dvec3(0.0)), std::numeric_limits<double>::infinity());
  EXPECT_EQ(closest_position(ring, {1, 2, 3}, 1e-6), dvec3(1, 2, 3));
}

TEST(VertexPlacement, ClosestPointIsNoFartherThanAnyPointOfTheTriangle) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> u;
  for (int round = 0; round < 2000; ++round) {
    const dvec3 p = random_point(rng), a = random_point(rng), b = random_point(rng);
    dvec3 c = random_point(rng);
    if (round % 10 == 0) c = a + (b - a) * u(rng);  // degenerate
    if (round % 50 == 0) c = b;
    const dvec3 bary = closest_barycentric(p, a, b, c);
    EXPECT_NEAR(bary.x + bary.y + bary.z, 1.0, 1e-12);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(bary[i] >= -1e-12 && bary[i] <= 1 + 1e-12);
    const double distance = glm::length(bary.x * a + bary.y * b + bary.z * c - p);
    for (int i = 0; i <= 8; ++i) {
      for (int j = 0; i + j <= 8; ++j) {
        const dvec3 other = (i * 0.125) * a + (j * 0.125) * b + ((8 - i - j) * 0.125) * c;
        EXPECT_LE(distance, glm::length(other - p) + 1e-9);
      }
    }
  }
}

TEST(VertexPlacement, OnAPlaneTheOptimumIsInThePlane) {
  const CollapseRing ring = grid_ring([](double x, double y) { return 2 * x - y; });
  const dvec3 x = closest_position(ring, {0.3, 0.2, 1.5}, 1e-9);
  EXPECT_NEAR(x.z, 2 * x.x - x.y, 1e-6);
  EXPECT_LT(deviation_at(ring, x), 1e-6);
}

TEST(VertexPlacement, TheOptimumIsNotFartherFromTheSurfaceThanTheStart) {
  std::mt19937 rng(2);
  for (int round = 0; round < 50; ++round) {
    std::normal_distribution<double> normal(0.0, 0.3);
    const CollapseRing ring = grid_ring([&](double, double) { return normal(rng); });
    const dvec3 start(0.5, 0.0, normal(rng));
    const dvec3 x = closest_position(ring, start, 1e-6);
    // Every half step lowers the sum of squares, which bounds the largest distance from both sides.
    const double samples = static_cast<double>(ring.samples_before.size() + ring.neighbours_after.size() + 1);
    EXPECT_LE(deviation_at(ring, x), std::sqrt(samples) * deviation_at(ring, start) + 1e-9);
    EXPECT_LT(glm::length(x - start), 2.0);
  }
}

TEST(VertexPlacement, RestoresTheAreaOfCurvedRingsAndKeepsPlanesPlane) {
  const CollapseRing plane = grid_ring([](double x, double y) { return x + 3 * y; });
  const dvec3 x(0.5, 0.1, 0.8);
  EXPECT_LT(glm::length(restore_area(plane, x, with_same_volume(plane, x)) - x), 1e-9);
  for (const double curvature : {-0.3, -0.05, 0.05, 0.3}) {
    const CollapseRing bowl = grid_ring([=](double px, double py) { return curvature * (squared({px - 0.5, py, 0})); });
    const dvec3 optimum = closest_position(bowl, {0.5, 0.0, 0.0}, 1e-6);
    const double before = area_before(bowl);
    const double error = std::abs(area_after(bowl, optimum) - before);
    const double restored =
        std::abs(area_after(bowl, restore_area(bowl, optimum, with_same_volume(bowl, optimum))) - before);
    EXPECT_LE(restored, error + 1e-12);
    EXPECT_LT(restored, 0.002 * before);
  }
}

TEST(VertexPlacement, AFoldedSheetStaysWhereItIs) {
  // Two coincident layers: the enclosed volume hardly depends on x.
  CollapseRing ring = grid_ring([](double, double) { return 0.0; });
  const CollapseRing front = ring;
  for (const BoundedTriangle& t : front.before) {
    const auto& [a, b, c] = t.corners;
    ring.before.push_back({a, c, b});
  }
  for (const auto& [q, s] : front.after) ring.after.push_back({s, q});
  const dvec3 x(0.5, 0.0, 0.05);
  EXPECT_LT(glm::length(with_same_volume(ring, x) - x), 1e-6);
}

TEST(VertexPlacement, ABorderEnclosesTheSameArea) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const auto cross2 = [](const dvec3& a, const dvec3& b) { return a.x * b.y - a.y * b.x; };
  for (int round = 0; round < 200; ++round) {
    const dvec3 p(0), a(u(rng), u(rng), 0), b(u(rng), u(rng), 0), q(u(rng), u(rng), 0);
    const dvec3 start(u(rng), u(rng), u(rng));
    const auto x = with_same_border_area(p, a, b, q, start);
    if (!x) continue;
    EXPECT_NEAR(cross2(*x, q), cross2(a, b) + cross2(b, q), 1e-9);
    EXPECT_NEAR(glm::dot(*x - start, q), 0.0, 1e-9);
  }
  EXPECT_FALSE(with_same_border_area({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {0, 0, 0}));
}

}  // namespace
}  // namespace farfield
