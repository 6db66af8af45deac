// SPDX-License-Identifier: Apache-2.0
#include "prefilter/weld.h"

#include <gtest/gtest.h>

#include <random>

namespace farfield {
namespace {

/// A grid of n x n separate unit quads, every corner a vertex of its own, each moved by up to `jitter`.
struct Soup {
  std::vector<vec3> positions;
  std::vector<uint32_t> face_begin{0}, corners;
};

Soup soup(int n, float jitter) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<float> noise(-jitter, jitter);
  Soup out;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      for (const auto& [dx, dy] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
        out.corners.push_back(static_cast<uint32_t>(out.positions.size()));
        out.positions.emplace_back(static_cast<float>(x + dx) + noise(rng), static_cast<float>(y + dy) + noise(rng),
                                   noise(rng));
      }
      out.face_begin.push_back(static_cast<uint32_t>(out.corners.size()));
    }
  }
  return out;
}

TEST(Weld, QuadSoupBecomesAGrid) {
  const Soup s = soup(20, 0);
  const WeldResult result = weld(s.positions, s.face_begin, s.corners);
  EXPECT_EQ(result.positions.size(), 21u * 21u);
  EXPECT_EQ(result.near_welds, 0u);
  for (size_t v = 0; v < s.positions.size(); ++v) EXPECT_EQ(result.positions[result.vertex_of[v]], s.positions[v]);
}

TEST(Weld, RoundingNoiseIsJoinedAlsoAcrossCells) {
  const Soup s = soup(20, 4e-6f);  // the bounds are 20 long: within 1e-6 of them, except along diagonals of noise
  const WeldResult result = weld(s.positions, s.face_begin, s.corners);
  EXPECT_EQ(result.positions.size(), 21u * 21u);
  for (size_t v = 0; v < s.positions.size(); ++v) {
    EXPECT_LT(glm::length(result.positions[result.vertex_of[v]] - s.positions[v]), 20e-6f);
  }
}

TEST(Weld, DistinctVerticesStayDistinct) {
  const Soup s = soup(20, 1e-3f);
  EXPECT_EQ(weld(s.positions, s.face_begin, s.corners).positions.size(), 20u * 20u * 4u);
}

TEST(Weld, DetailFinerThanTheToleranceOfALargeMeshNeverCollapses) {
  Soup s = soup(4, 0);
  for (vec3& p : s.positions) p *= 1e-5f;  // quads of 1e-5 beside a triangle of 1e4
  for (const vec3& p : {vec3(0, 0, 1e4f), vec3(1e4f, 0, 1e4f), vec3(0, 1e4f, 1e4f)}) {
    s.corners.push_back(static_cast<uint32_t>(s.positions.size()));
    s.positions.push_back(p);
  }
  s.face_begin.push_back(static_cast<uint32_t>(s.corners.size()));
  EXPECT_EQ(weld(s.positions, s.face_begin, s.corners).positions.size(), 25u + 3u);
}

TEST(Weld, SignedZerosAreEqualAndUnusedVerticesGo) {
  const std::vector<vec3> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0f, 0, 0}, {9, 9, 9}, {1, 1, 0}};
  const std::vector<uint32_t> begin = {0, 3, 6}, corners = {0, 1, 2, 3, 1, 5};
  const WeldResult result = weld(positions, begin, corners);
  EXPECT_EQ(result.positions.size(), 4u);
  EXPECT_EQ(result.vertex_of[0], result.vertex_of[3]);
  EXPECT_EQ(result.vertex_of[4], UINT32_MAX);
}

TEST(Weld, NothingAndOnePointAreFine) {
  EXPECT_TRUE(weld({}, std::vector<uint32_t>{0}, {}).positions.empty());
  const std::vector<vec3> same(3, vec3(1, 2, 3));
  EXPECT_EQ(weld(same, std::vector<uint32_t>{0, 3}, std::vector<uint32_t>{0, 1, 2}).positions.size(), 1u);
}

}  // namespace
}  // namespace farfield
