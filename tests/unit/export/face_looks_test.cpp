// SPDX-License-Identifier: Apache-2.0
#include "export/face_looks.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/level_builder.h"

namespace farfield {
namespace {

/// A pair and a lone triangle, in the plane z = 0.
LevelData three_faces() {
  LevelData level = test::empty_level(1, 0.5f);
  test::set_quads(level, {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}, {5, 0, 0}}, {{0, 1, 2, 3}, {1, 4, 2, 2}});
  test::set_diffuse(level, vec3(0.25f));
  return level;
}

TEST(FaceLooks, KnowCornersAndAreasOfPairsAndLoneTriangles) {
  const LevelData level = three_faces();
  const std::vector<uvec3> corners = face_corners(view_of(level));
  EXPECT_EQ(corners, (std::vector<uvec3>{{0, 1, 3}, {2, 3, 1}, {1, 4, 2}}));
  const std::vector<FaceLook> looks = face_looks(view_of(level), corners);
  EXPECT_DOUBLE_EQ(looks[0].area, 1);
  EXPECT_DOUBLE_EQ(looks[1].area, 1);
  EXPECT_DOUBLE_EQ(looks[2].area, 1.5);
  EXPECT_NEAR(looks[2].diffuse.x, 0.25f, 0.002f);
  EXPECT_EQ(looks[2].opacity, 1.0f);
}

TEST(FaceLooks, TakeGapsOffOpacity) {
  LevelData level = three_faces();
  level.face_opacity = {255, 204, 102};
  level.face_gap = {0, 127, 255};
  const auto looks = face_looks(view_of(level), face_corners(view_of(level)));
  EXPECT_EQ(looks[0].opacity, 1.0f);
  EXPECT_NEAR(looks[1].opacity, 0.8f * 128 / 255, 1e-6f);
  EXPECT_EQ(looks[2].opacity, 0.0f);
}

TEST(FaceLooks, AreAsRoughAsHighlightAndNormalsTogether) {
  LevelData level = three_faces();
  level.face_specular.assign(3, pack_color(vec3(0.04f)));
  level.face_roughness2.assign(3, pack_unorm8(0.25f));
  const auto roughness_with = [&](const SymMat3& normals) {
    level.face_sggx.assign(3, pack_surface_sggx(normals));
    return face_looks(view_of(level), face_corners(view_of(level)))[0].roughness;
  };
  const float own = std::pow(unpack_unorm8(pack_unorm8(0.25f)), 0.25f);
  EXPECT_NEAR(roughness_with(SymMat3::outer({0, 0, 1})), own, 1e-4f);  // flat
  EXPECT_NEAR(roughness_with({0.1f, 0.1f, 1, 0, 0, 0}), std::pow(0.25f * 1.1f + 0.1f, 0.25f) / std::pow(1.05f, 0.25f),
              2e-3f);
  EXPECT_EQ(roughness_with(SymMat3::identity()), 1.0f);  // any normal is as likely
  EXPECT_EQ(roughness_with(SymMat3::outer({1, 0, 0})), 1.0f);
}

}  // namespace
}  // namespace farfield
