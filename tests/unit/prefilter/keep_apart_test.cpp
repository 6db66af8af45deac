// SPDX-License-Identifier: Apache-2.0
#include "prefilter/keep_apart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "prefilter/ray_scene.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using namespace test;

constexpr float kResolution = 0.25f;

/// Two spheres, the inner one wound the other way and with other vertices.
Surface double_ball(float inner_radius) {
  Surface inner = make_sphere(150, 76, inner_radius);
  for (uvec3& t : inner.triangles) std::swap(t.x, t.y);
  return join(make_sphere(160, 80, 1.0f), inner);
}

SimplifyResult simplified(const Surface& surface, float resolution = kResolution) {
  return simplify(surface, {.resolution = resolution});
}

/// Of rays from everywhere towards the middle, those that meet the inner ball first.
int seen_of_inner(const Surface& surface, const std::vector<uint8_t>& is_inner) {
  const auto scene = RayScene::build(surface);
  Rng rng(1);
  int seen = 0;
  for (int i = 0; i < 20000; ++i) {
    const vec3 from = 3.0f * random_unit(rng), aim = 0.5f * random_unit(rng);
    const auto hit = scene->first_hit(from, glm::normalize(aim - from), 0, 10);
    seen += hit && is_inner[hit->triangle];
  }
  return seen;
}

std::vector<uint8_t> inner_faces(const Surface& before, const SimplifyResult& after, size_t first_inner) {
  std::vector<uint8_t> is_inner(after.surface.triangles.size(), 0);
  for (size_t f = first_inner; f < before.triangles.size(); ++f) {
    if (after.face_map[f] < is_inner.size()) is_inner[after.face_map[f]] = 1;
  }
  return is_inner;
}

TEST(KeepApart, TheInnerOfTwoBallsStaysInside) {
  for (const float gap : {0.001f, 0.01f, 0.05f}) {
    const Surface source = double_ball(1 - gap);
    const size_t first_inner = make_sphere(160, 80, 1.0f).triangles.size();
    SimplifyResult result = simplified(source);
    const Surface without = result.surface;
    const auto is_inner = inner_faces(source, result, first_inner);
    const auto report = keep_apart(source, kResolution, result);
    ASSERT_TRUE(report);
    if (gap == 0.001f) {
      EXPECT_GT(seen_of_inner(without, is_inner), 2000);
    }
    EXPECT_LE(seen_of_inner(result.surface, is_inner), 10) << gap;
    EXPECT_GT(report->walls, 100u);
    EXPECT_EQ(report->crossing, 0u) << gap;
    for (size_t f = 0; f < is_inner.size(); ++f) {  // the outer one is where it was
      if (is_inner[f]) continue;
      for (int c = 0; c < 3; ++c) {
        const uint32_t v = result.surface.triangles[f][c];
        EXPECT_EQ(result.surface.positions[v], without.positions[v]);
      }
    }
    for (size_t v = 0; v < without.positions.size(); ++v) {
      EXPECT_LE(glm::length(result.surface.positions[v] - without.positions[v]), 0.2501f * kResolution);
    }
  }
}

TEST(KeepApart, OpenBowlsToo) {
  const auto bowl = [](int around, float radius) {
    return make_grid(around, 40, true, [=](float u, float v) {
      const float theta = kPi * (1.0f - 0.55f * (1 - v)), phi = 2 * kPi * u;
      return radius * vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    });
  };
  const Surface outer = bowl(160, 1.0f), source = join(outer, bowl(150, 0.999f));
  SimplifyResult result = simplified(source);
  const auto is_inner = inner_faces(source, result, outer.triangles.size());
  const auto report = keep_apart(source, kResolution, result);
  ASSERT_TRUE(report);
  const auto scene = RayScene::build(result.surface);
  Rng rng(1);
  int from_inside = 0, inner_first = 0, from_below = 0, outer_first = 0;
  for (int i = 0; i < 20000; ++i) {
    const vec3 towards = glm::normalize(vec3(1, 1, -1) * glm::abs(random_unit(rng)) * vec3(i % 2 ? 1 : -1, 1, 1));
    if (towards.z > -0.2f) continue;
    const auto inside = scene->first_hit(vec3(0.0f), towards, 0, 3);
    if (inside) ++from_inside, inner_first += is_inner[inside->triangle];
    const auto below = scene->first_hit(3.0f * towards, -towards, 0, 3);
    if (below) ++from_below, outer_first += !is_inner[below->triangle];
  }
  ASSERT_GT(from_inside, 5000);
  EXPECT_GE(inner_first, from_inside * 999 / 1000);
  EXPECT_GE(outer_first, from_below * 999 / 1000);
}

TEST(KeepApart, FlatWallsThatDoNotCrossStayAsTheyAre) {
  Surface behind = make_plane(38, 41, 4, 4);
  for (vec3& p : behind.positions) p.z = -0.01f;
  const Surface source = join(make_plane(40, 40, 4, 4), behind);
  SimplifyResult result = simplified(source);
  const Surface without = result.surface;
  const auto report = keep_apart(source, kResolution, result);
  ASSERT_TRUE(report);
  EXPECT_GT(report->walls, 100u);
  EXPECT_EQ(report->crossing, 0u);
  EXPECT_EQ(result.surface.positions, without.positions);
}

TEST(KeepApart, WhatHasNoOtherWallCloseByIsLeftAlone) {
  Surface far = make_sphere(40, 20, 1.0f);
  for (vec3& p : far.positions) p.x += 2.5f;
  for (const Surface& source :
       {make_sphere(80, 40, 1.0f), join(make_sphere(80, 40, 1.0f), far), leaf_cloud({.count = 500}), Surface{}}) {
    for (const float resolution : {kResolution, 0.0f}) {
      SimplifyResult result = simplified(source, resolution);
      const Surface without = result.surface;
      const auto report = keep_apart(source, resolution, result);
      ASSERT_TRUE(report);
      EXPECT_EQ(report->walls, 0u);
      EXPECT_EQ(result.surface.positions, without.positions);
    }
  }
}

TEST(KeepApart, WallsThatTouchAndWallsThatCrossDoNoHarm) {
  Surface tilted = make_plane(40, 40, 4, 4);
  for (vec3& p : tilted.positions) p.z = 0.02f * (p.x - 2);
  for (const Surface& other : {make_plane(40, 40, 4, 4), tilted}) {
    const Surface source = join(make_plane(40, 40, 4, 4), other);
    SimplifyResult result = simplified(source);
    const Surface without = result.surface;
    ASSERT_TRUE(keep_apart(source, kResolution, result));
    for (size_t v = 0; v < without.positions.size(); ++v) {
      EXPECT_LE(glm::length(result.surface.positions[v] - without.positions[v]), 0.01f);
    }
  }
}

TEST(KeepApart, ThreadsDoNotMatter) {
  const Surface source = double_ball(0.99f);
  std::vector<std::vector<vec3>> positions;
  for (const int threads : {1, 4}) {
    const ThreadLimit limit(threads);
    SimplifyResult result = simplified(source);
    ASSERT_TRUE(keep_apart(source, kResolution, result));
    positions.push_back(result.surface.positions);
  }
  EXPECT_EQ(positions[0], positions[1]);
}

}  // namespace
}  // namespace farfield
