// SPDX-License-Identifier: Apache-2.0
#include "prefilter/macrosurface.h"

#include <gtest/gtest.h>

#include <atomic>

#include <algorithm>
#include <random>

#include "base/parallel.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using namespace test;

double macrosurface_part(const Surface& surface, float resolution) {
  const std::vector<uint8_t> classes = classify_macrosurface(surface, resolution);
  EXPECT_EQ(classes.size(), surface.triangles.size());
  return static_cast<double>(std::count(classes.begin(), classes.end(), 1)) / static_cast<double>(classes.size());
}

Surface bumpy_plane(int side, float amplitude) {
  return make_grid(side, side, false,
                   [=](float u, float v) { return vec3(u, v, amplitude * std::sin(40.0f * u) * std::sin(40.0f * v)); });
}

TEST(Macrosurface, ASphereIsOneWhileTheResolutionIsSmallerThanItsRadius) {
  const Surface sphere = make_sphere(48, 24, 1.0f);
  for (const float resolution : {0.02f, 0.1f, 0.3f, 0.9f}) EXPECT_EQ(macrosurface_part(sphere, resolution), 1.0);
  for (const float resolution : {1.01f, 1.5f, 2.1f, 100.0f}) EXPECT_EQ(macrosurface_part(sphere, resolution), 0.0);
}

TEST(Macrosurface, AThinTubeIsNone) {
  const Surface tube = make_tube(12, 200, 0.02f, 4.0f);
  EXPECT_EQ(macrosurface_part(tube, 0.1f), 0.0);  // not even its ends: too small a piece (7.2.2)
  EXPECT_EQ(macrosurface_part(tube, 0.005f), 1.0);
}

TEST(Macrosurface, ARibbonIsOneWhenItIsWiderThanTheBall) {
  const Surface ribbon = make_plane(200, 10, 10.0f, 0.5f);
  EXPECT_EQ(macrosurface_part(ribbon, 0.6f), 0.0);
  EXPECT_EQ(macrosurface_part(ribbon, 0.1f), 1.0);
}

TEST(Macrosurface, APlaneIsOneUpToItsBorder) {
  const Surface plane = make_plane(40, 40, 1.0f, 1.0f);
  EXPECT_EQ(macrosurface_part(plane, 0.1f), 1.0);
  EXPECT_EQ(macrosurface_part(plane, 2.0f), 0.0);
}

TEST(Macrosurface, SmallBumpsDoNotMatter) { EXPECT_EQ(macrosurface_part(bumpy_plane(100, 0.01f), 0.1f), 1.0); }

TEST(Macrosurface, DisconnectedSmallPartsAreNoneEvenWhereTheyFormAPlane) {
  // A chessboard of separate tiles (figure 7.1 d): nothing local tells that they form a wall.
  Surface tiles;
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 10; ++j) {
      Surface tile = make_plane(2, 2, 0.09f, 0.09f);
      for (vec3& p : tile.positions) p += 0.1f * vec3(i, j, 0);
      tiles = join(std::move(tiles), tile);
    }
  }
  EXPECT_EQ(macrosurface_part(tiles, 0.1f), 0.0);
  EXPECT_EQ(macrosurface_part(tiles, 0.02f), 1.0);
}

TEST(Macrosurface, ATwigOnAWallIsSubResolutionAndTheWallIsNot) {
  // A plane that grows a thin ribbon out of its border: connected, but two different things.
  const Surface surface = make_grid(40, 40, false, [](float u, float v) { return vec3(u, v, 0); });
  Surface with_ribbon = surface;
  const uint32_t first = static_cast<uint32_t>(surface.positions.size());
  const uint32_t left = 40u * 41u + 20u, right = left + 1;  // on the border v = 1
  for (int i = 1; i <= 40; ++i) {
    with_ribbon.positions.push_back(surface.positions[left] + vec3(0, 0.025f * static_cast<float>(i), 0));
    with_ribbon.positions.push_back(surface.positions[right] + vec3(0, 0.025f * static_cast<float>(i), 0));
  }
  for (uint32_t i = 0; i < 40; ++i) {
    const uint32_t a = i == 0 ? left : first + 2 * (i - 1), b = i == 0 ? right : first + 2 * (i - 1) + 1;
    const uint32_t c = first + 2 * i, d = c + 1;
    with_ribbon.triangles.emplace_back(a, b, d);
    with_ribbon.triangles.emplace_back(a, d, c);
  }
  add_materials(with_ribbon);
  const auto classes = classify_macrosurface(with_ribbon, 0.1f);
  const vec3 joint = 0.5f * (surface.positions[left] + surface.positions[right]);
  for (size_t face = 0; face < classes.size(); ++face) {
    const vec3 corner = with_ribbon.positions[with_ribbon.triangles[face].x];
    if (glm::length(corner - joint) < 0.15f) continue;  // there it is ambiguous
    const bool in_ribbon = face >= surface.triangles.size();
    EXPECT_EQ(classes[face], in_ribbon ? 0 : 1) << face;
  }
}

TEST(Macrosurface, FinenessOfTheMeshDoesNotChangeTheAnswer) {
  // The finer mesh is classified by patches, the coarser one face by face.
  const auto classes_along = [](int around, int along) {
    const float resolution = 0.25f;  // against a cone whose radius falls from 0.5 to 0.02
    const Surface cone = make_grid(around, along, true, [](float u, float v) {
      const float radius = 0.5f + v * (0.02f - 0.5f);
      return vec3(radius * std::cos(2 * kPi * u), radius * std::sin(2 * kPi * u), 4.0f * v);
    });
    const auto classes = classify_macrosurface(cone, resolution);
    double lowest = 1, highest = 0;  // macrosurface reaches from v = 0 to this v
    for (size_t face = 0; face < classes.size(); ++face) {
      const float v = cone.positions[cone.triangles[face].x].z / 4.0f;
      if (classes[face]) highest = std::max<double>(highest, v);
      if (!classes[face]) lowest = std::min<double>(lowest, v);
    }
    return std::pair(lowest, highest);
  };
  const auto coarse = classes_along(24, 60), fine = classes_along(120, 300);
  EXPECT_NEAR(coarse.first, fine.first, 0.05);
  EXPECT_NEAR(coarse.second, fine.second, 0.05);
  EXPECT_NEAR(fine.second, 0.8, 0.08);  // where the diameter is the radius of the ball
}

TEST(Macrosurface, WindingAndOrderOfFacesDoNotMatter) {
  const Surface tube = make_tube(16, 60, 0.3f, 3.0f);
  const auto expected = classify_macrosurface(tube, 0.5f);
  Surface shuffled = tube;
  std::mt19937 rng(5);
  for (uvec3& t : shuffled.triangles) {
    if (rng() % 2) std::swap(t.x, t.z);
  }
  EXPECT_EQ(classify_macrosurface(shuffled, 0.5f), expected);
  std::reverse(shuffled.triangles.begin(), shuffled.triangles.end());
  auto reversed = classify_macrosurface(shuffled, 0.5f);
  std::reverse(reversed.begin(), reversed.end());
  EXPECT_EQ(reversed, expected);
}

TEST(Macrosurface, ThreeFacesAtAnEdgeAreOneNeighbourhood) {
  // A fin that stands on a plane along the row of vertices v = 0.5.
  Surface surface = make_plane(40, 40, 1.0f, 1.0f);
  const uint32_t first = static_cast<uint32_t>(surface.positions.size()), row = 20 * 41;
  for (uint32_t i = 0; i <= 40; ++i) surface.positions.push_back(surface.positions[row + i] + vec3(0, 0, 0.5f));
  for (uint32_t i = 0; i < 40; ++i) {
    surface.triangles.emplace_back(row + i, row + i + 1, first + i + 1);
    surface.triangles.emplace_back(row + i, first + i + 1, first + i);
  }
  add_materials(surface);
  EXPECT_EQ(macrosurface_part(surface, 0.1f), 1.0);
}

TEST(Macrosurface, SmallIslandsJoinTheMacrosurfaceAroundThem) {
  // A hole of nearly the ball's size: around it the curve has two components, and that alone would tear the plane
  // apart.
  Surface plane = make_plane(40, 40, 1.0f, 1.0f);
  std::erase_if(plane.triangles, [&](const uvec3& t) {
    const vec3 middle = (plane.positions[t.x] + plane.positions[t.y] + plane.positions[t.z]) / 3.0f;
    return std::abs(middle.x - 0.5f) < 0.02f && std::abs(middle.y - 0.5f) < 0.02f;
  });
  add_materials(plane);
  EXPECT_EQ(macrosurface_part(plane, 0.05f), 1.0);
}

TEST(Macrosurface, TheAnswerDoesNotDependOnTheNumberOfThreads) {
  const Surface surface = join(make_tube(12, 300, 0.1f, 3.0f), bumpy_plane(60, 0.08f));
  const auto expected = classify_macrosurface(surface, 0.1f);
  const ThreadLimit one(1);
  EXPECT_EQ(classify_macrosurface(surface, 0.1f), expected);
}

TEST(Macrosurface, ExtremesHaveDefinedAnswers) {
  EXPECT_TRUE(classify_macrosurface(Surface{}, 1.0f).empty());
  const Surface plane = make_plane(4, 4, 1.0f, 1.0f);
  EXPECT_EQ(macrosurface_part(plane, 0.0f), 1.0);
  EXPECT_EQ(macrosurface_part(plane, -1.0f), 1.0);
  EXPECT_EQ(macrosurface_part(plane, std::numeric_limits<float>::quiet_NaN()), 1.0);
  EXPECT_EQ(macrosurface_part(plane, std::numeric_limits<float>::infinity()), 0.0);
  EXPECT_EQ(macrosurface_part(plane, 1e-30f), 1.0);
  EXPECT_EQ(macrosurface_part(make_plane(4, 4, 1e30f, 1e30f), 1e28f), 1.0);
  EXPECT_EQ(macrosurface_part(make_plane(4, 4, 1e-30f, 1e-30f), 1e-33f), 1.0);
  EXPECT_EQ(macrosurface_part(make_plane(1, 1, 0.0f, 0.0f), 1.0f), 0.0);    // all vertices in one point
  EXPECT_EQ(macrosurface_part(make_plane(30, 1, 1.0f, 0.0f), 10.0f), 0.0);  // all faces without area
}

TEST(Macrosurface, EndsOnceCancelled) {
  const std::atomic<bool> cancel{true};
  const Surface sphere = test::make_sphere(32, 16, 1.0f);
  EXPECT_EQ(classify_macrosurface(sphere, 0.1f, {{}, &cancel}), std::vector<uint8_t>(sphere.triangles.size(), 0));
}

}  // namespace
}  // namespace farfield
