// SPDX-License-Identifier: Apache-2.0
#include "cache/placed_parts.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "cache/level_check.h"
#include "tests/support/level_builder.h"

namespace farfield {
namespace {

/// From a part to the level: turned by 90 degrees about z, twice as large, moved.
const glm::dmat4x3 kToLevel{0, 2, 0, -2, 0, 0, 0, 0, 2, 10, 20, 30};
const mat4x3 kToPart{0, -0.5f, 0, 0.5f, 0, 0, 0, 0, 0.5f, -10, 5, -15};

/// Level 0: a triangle of its own, and a part of one quad in two places.
LevelData level_with_part() {
  LevelData level = test::empty_level(0, 0.1f);
  test::set_quads(level, {{-1, 0, 0}, {-2, 0, 0}, {-1, 1, 0}, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
                  {{0, 1, 2, 2}, {3, 4, 5, 6}});
  level.face_diffuse.resize(3);
  for (uint8_t f = 0; f < 3; ++f) level.face_diffuse[f].sqrt_rgb = {f, f, f};
  level.face_material = {7, 8, 9};
  level.source_face = {0, 1 << kSourceTurnBits, 2 << kSourceTurnBits | 1};
  level.corner_vertex = {{0, 0, 0}, {1, 2, 1}, {2, 2, 1}};
  for (const vec3 n : {vec3(0, 0, 1), vec3(1, 0, 0), vec3(0, 1, 0)}) level.shading_normal.push_back(pack_normal(n));
  level.part_first_quad = {1};
  level.placements = {{mat4x3(1.0f), 0, 0}, {kToPart, 0, 40}};
  level.header.bounds = {vec3(-2, 0, 0), vec3(12, 22, 30)};
  return level;
}

TEST(PlacedParts, PlacesAreUndoneExactly) {
  const glm::dmat4x3 found = to_level({kToPart, 0, 0});
  for (int c = 0; c < 4; ++c) EXPECT_LT(glm::length(found[c] - kToLevel[c]), 1e-12) << c;
  EXPECT_TRUE(can_be_undone(kToPart));
  EXPECT_FALSE(can_be_undone(mat4x3(0.0f)));
  EXPECT_FALSE(can_be_undone(mat4x3(1e-20f)));  // 1e20 back
  EXPECT_TRUE(can_be_undone(mat4x3(1e-9f)));
}

TEST(PlacedParts, PointsAreVisitedWhereTheyStand) {
  const LevelData level = level_with_part();
  ASSERT_EQ(find_structure_problem(view_of(level)).value_or(""), "");
  Box3 box;
  size_t count = 0;
  for_each_surface_point(view_of(level), [&](const vec3& p) { box.extend(p), ++count; });
  EXPECT_EQ(count, 4u + 2 * 4u);  // a lone triangle has its last corner twice
  EXPECT_EQ(box.lower, vec3(-2, 0, 0));
  EXPECT_EQ(box.upper, vec3(10, 22, 30));
}

TEST(PlacedParts, AFlatLevelHasEveryPlaceWithAllThatItsFacesHave) {
  const LevelData level = level_with_part();
  const LevelData flat = flattened(view_of(level));
  ASSERT_EQ(find_structure_problem(view_of(flat)).value_or(""), "");
  EXPECT_EQ(find_value_problem(view_of(flat)).value_or(""), "");
  EXPECT_FALSE(flat.has_parts());
  ASSERT_EQ(flat.quads.size(), 3u);
  EXPECT_EQ(face_count(flat), 5u);
  EXPECT_EQ(flat.positions.size(), 3u + 2 * 4u);
  EXPECT_EQ(flat.positions[flat.quads[1].v2], vec3(1, 1, 0));
  EXPECT_EQ(flat.positions[flat.quads[2].v2], vec3(8, 22, 30));
  EXPECT_EQ(flat.face_material, (std::vector<uint16_t>{7, 8, 9, 8, 9}));
  EXPECT_EQ(flat.face_diffuse[4].sqrt_rgb[0], 2);
  EXPECT_EQ(flat.source_face[2] >> kSourceTurnBits, 2u);
  EXPECT_EQ(flat.source_face[4], 42u << kSourceTurnBits | 1u);
  const vec3 turned = unpack_normal(flat.shading_normal[flat.corner_vertex[4].x]);  // (0, 1, 0) in the part
  EXPECT_LT(glm::length(turned - vec3(-1, 0, 0)), 1e-3f);
}

TEST(PlacedParts, ALevelWithoutPartsIsItsOwnFlatOne) {
  const LevelData soup = test::triangle_soup(100, 0.1f, 1);
  const LevelData flat = flattened(view_of(soup));
  EXPECT_EQ(flat.quads.size(), soup.quads.size());
  for (size_t i = 0; i < soup.quads.size(); ++i) {
    EXPECT_EQ(flat.positions[flat.quads[i].v1], soup.positions[soup.quads[i].v1]);
  }
}

}  // namespace
}  // namespace farfield
