// SPDX-License-Identifier: Apache-2.0
#include "prefilter/gentle_slopes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using namespace test;

std::vector<uint8_t> gentle_faces(const Surface& surface, double resolution) {
  const EdgeTable edges = build_edge_table(surface.triangles, surface.positions.size());
  return find_gentle_faces(surface, edges, make_blocks(surface, edges, resolution / 16), resolution, {});
}

double gentle_part(const Surface& surface, double resolution) {
  const std::vector<uint8_t> gentle = gentle_faces(surface, resolution);
  EXPECT_EQ(gentle.size(), surface.triangles.size());
  return static_cast<double>(std::ranges::count(gentle, 1)) / static_cast<double>(gentle.size());
}

Surface wavy_plane(float steepness) {
  return make_grid(300, 150, false,
                   [=](float u, float v) { return vec3(u, v, steepness / 40.0f * std::sin(40.0f * u)); });
}

TEST(GentleSlopes, ASphereIsGentleWhereItIsLargeAgainstTheBall) {
  const Surface sphere = make_sphere(400, 200, 1.0f);
  EXPECT_EQ(gentle_part(sphere, 0.1), 1.0);
  EXPECT_EQ(gentle_part(sphere, 0.9), 0.0);  // 0.9 and more of it lie beyond 41 degrees
  EXPECT_EQ(gentle_part(sphere, 5.0), 0.0);
}

TEST(GentleSlopes, SlopesNearOneAreNot) {
  EXPECT_GT(gentle_part(wavy_plane(0.6f), 0.1), 0.3);  // all but what is near the border
  EXPECT_EQ(gentle_part(wavy_plane(3.0f), 0.1), 0.0);
  EXPECT_GT(gentle_part(wavy_plane(3.0f), 0.03), 0.05);  // flanks, which are flat as well
}

TEST(GentleSlopes, BordersAreFartherThanTheResolution) {
  const Surface plane = make_plane(40, 40, 1.0f, 1.0f);
  constexpr float kSlopeResolution = 0.1f, kPatchAndFace = 0.12f;
  const std::vector<uint8_t> gentle = gentle_faces(plane, kSlopeResolution);
  for (size_t face = 0; face < gentle.size(); ++face) {
    const uvec3& t = plane.triangles[face];
    const vec3 middle = (plane.positions[t.x] + plane.positions[t.y] + plane.positions[t.z]) / 3.0f;
    const float to_border = std::min(std::min(middle.x, 1 - middle.x), std::min(middle.y, 1 - middle.y));
    EXPECT_TRUE(to_border >= kSlopeResolution || !gentle[face]) << face;
    EXPECT_TRUE(to_border <= kSlopeResolution + kPatchAndFace || gentle[face]) << face;
  }
}

TEST(GentleSlopes, AFoldOfTwoSheetsIsNotWhateverTheirWinding) {
  // A plane that turns back on itself along v = 0.5: all normals lie along z.
  const Surface fold = make_grid(20, 20, false, [](float u, float v) { return vec3(u, std::abs(v - 0.5f), 0.0f); });
  Surface turned = fold;
  for (size_t face = turned.triangles.size() / 2; face < turned.triangles.size(); ++face)
    std::swap(turned.triangles[face].x, turned.triangles[face].z);
  for (const Surface* surface : {&fold, &std::as_const(turned)}) {
    const std::vector<uint8_t> gentle = gentle_faces(*surface, 0.1);
    for (size_t face = 0; face < gentle.size(); ++face) {
      EXPECT_TRUE(surface->positions[surface->triangles[face].x].y >= 0.1f || !gentle[face]) << face;
    }
  }
}

TEST(GentleSlopes, WindingAndThreadsDoNotMatter) {
  const Surface sphere = make_sphere(96, 48, 1.0f);
  const auto expected = gentle_faces(sphere, 0.2);
  EXPECT_GT(std::ranges::count(expected, 1), 0);
  Surface shuffled = sphere;
  for (size_t face = 0; face < shuffled.triangles.size(); face += 3)
    std::swap(shuffled.triangles[face].x, shuffled.triangles[face].z);
  EXPECT_EQ(gentle_faces(shuffled, 0.2), expected);
  const ThreadLimit one(1);
  EXPECT_EQ(gentle_faces(sphere, 0.2), expected);
}

TEST(GentleSlopes, ExtremesAreDefined) {
  EXPECT_TRUE(gentle_faces(Surface{}, 1.0).empty());
  Surface needle = make_plane(40, 40, 1.0f, 1.0f);
  for (vec3& p : needle.positions) p.x = 0;  // no face has an area
  EXPECT_EQ(gentle_part(needle, 0.1), 0.0);
  Surface far = make_sphere(400, 200, 1.0f);
  for (vec3& p : far.positions) p += vec3(1e4f, 0, 0);
  EXPECT_GT(gentle_part(far, 0.1), 0.5);  // floats know its normals to some degrees
  Surface twice = make_plane(40, 40, 1.0f, 1.0f);
  const std::vector<uvec3> triangles = twice.triangles;
  twice.triangles.insert(twice.triangles.end(), triangles.begin(), triangles.end());
  add_materials(twice);
  EXPECT_EQ(gentle_part(twice, 0.1), 0.0);  // four faces at an edge
}

}  // namespace
}  // namespace farfield
