// SPDX-License-Identifier: Apache-2.0
#include "prefilter/walls.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "base/parallel.h"
#include "base/random.h"
#include "prefilter/triangle_pieces.h"
#include "prefilter/wall_shell.h"
#include "tests/support/ray_scenes.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using namespace test;

double part_of(WallKind kind, const Surface& surface, double resolution) {
  const auto walls = find_walls(surface, {}, resolution);
  EXPECT_TRUE(walls);
  EXPECT_EQ(walls->kinds.size(), surface.triangles.size());
  EXPECT_TRUE(walls->is_core.empty());
  return static_cast<double>(std::ranges::count(walls->kinds, kind)) / static_cast<double>(walls->kinds.size());
}
/// Of closed walls.
double wall_part(const Surface& surface, double resolution) { return part_of(WallKind::Closed, surface, resolution); }
/// Of half-open ones.
double sheet_part(const Surface& surface, double resolution) {
  return part_of(WallKind::HalfOpen, surface, resolution);
}

void add_quad(Surface& surface, const vec3& a, const vec3& b, const vec3& c, const vec3& d) {
  const auto first = static_cast<uint32_t>(surface.positions.size());
  surface.positions.insert(surface.positions.end(), {a, b, c, d});
  surface.triangles.emplace_back(first, first + 1, first + 2);
  surface.triangles.emplace_back(first, first + 2, first + 3);
}

void add_box(Surface& surface, const vec3& low, const vec3& high) {
  const auto corner = [&](int i) {
    return vec3(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z);
  };
  constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& s : kSides) add_quad(surface, corner(s[0]), corner(s[1]), corner(s[2]), corner(s[3]));
}

/// 20 boards, each a box of 1 x 20 x 0.2 with its gap.
Surface make_boards(float gap) {
  Surface boards;
  for (int i = 0; i < 20; ++i) {
    const auto x = static_cast<float>(i);
    add_box(boards, {x, 0, 0}, {x + 1 - gap, 20, 0.2f});
  }
  add_materials(boards);
  return boards;
}

double area_of(const Surface& surface) {
  double area = 0;
  for (size_t f = 0; f < surface.triangles.size(); ++f)
    area += 0.5 * glm::length(area_vector_of(corners_of(surface, f)));
  return area;
}

TEST(Walls, BoardsAreOneWhereTheirGapsAreNarrow) {
  for (const float gap : {0.0f, 0.02f, 0.1f}) EXPECT_EQ(wall_part(make_boards(gap), 2), 1.0) << gap;
  for (const float gap : {0.3f, 0.5f, 0.8f}) {
    EXPECT_EQ(wall_part(make_boards(gap), 2), 0.0) << gap;
    EXPECT_EQ(sheet_part(make_boards(gap), 2), 1.0) << gap;
  }
}

TEST(Walls, BoardsAreNoneWhereTheyAreThickOrFew) {
  EXPECT_EQ(wall_part(make_boards(0.02f), 0.2), 0.0);  // two surfaces, 1 resolution from each other
  EXPECT_EQ(wall_part(make_boards(0.02f), 20), 0.0);   // all of them are no larger than a resolution
}

TEST(Walls, OneBoardIsNone) {
  Surface board;
  add_box(board, vec3(0), {1, 20, 0.2f});
  add_materials(board);
  EXPECT_EQ(wall_part(board, 2), 0.0);
}

TEST(Walls, ASurfaceInsideIsTheirCoreAndClosesThem) {
  const auto wall_at = [](float z) {
    Surface surface;
    add_quad(surface, {-1, -1, z}, {21, -1, z}, {21, 21, z}, {-1, 21, z});
    add_materials(surface);
    return surface;
  };
  for (const float gap : {0.02f, 0.5f}) {
    const auto with_core = find_walls(make_boards(gap), wall_at(0.1f), 2);
    ASSERT_TRUE(with_core);
    EXPECT_EQ(std::ranges::count(with_core->kinds, WallKind::Closed), 20 * 12) << gap;
    EXPECT_EQ(with_core->is_core, std::vector<uint8_t>(2, 1)) << gap;
    const auto before_another = find_walls(make_boards(gap), wall_at(1.5f), 2);
    ASSERT_TRUE(before_another);
    EXPECT_EQ(std::ranges::count(before_another->kinds, gap < 0.1f ? WallKind::Closed : WallKind::HalfOpen), 20 * 12);
    EXPECT_EQ(before_another->is_core, std::vector<uint8_t>(2, 0)) << gap;
  }
}

TEST(Walls, ACoreThatLetsLightThroughIsNone) {
  Surface pane;
  add_quad(pane, {-1, -1, 0.1f}, {21, -1, 0.1f}, {21, 21, 0.1f}, {-1, 21, 0.1f});
  add_materials(pane);
  for (FaceMaterial& m : pane.materials) m.transmission = vec3(0.3f);
  const auto walls = find_walls(make_boards(0.5f), pane, 2);
  ASSERT_TRUE(walls);
  EXPECT_EQ(std::ranges::count(walls->kinds, WallKind::HalfOpen), 20 * 12);
  EXPECT_EQ(walls->is_core, std::vector<uint8_t>(2, 0));
}

TEST(Walls, AFewVoxelsAreNoHalfOpenOne) {
  EXPECT_EQ(sheet_part(make_boards(0.5f), 8), 0.0);  // 2.5 resolutions wide
  Surface fence = make_boards(0.5f);
  for (vec3& p : fence.positions) p.y *= 0.1f;  // one resolution high
  EXPECT_EQ(sheet_part(fence, 2), 0.0);
}

TEST(Walls, ScalesThatHideTheirGapsInPlacesAreNoHalfOpenOnes) {
  Surface scales;
  Rng rng(4);
  for (int i = 0; i < 900; ++i) {  // strewn in a plane: as much is covered as by boards, but unevenly
    const float x = 20 * rng.next(), y = 20 * rng.next();
    add_quad(scales, {x, y, 0}, {x + 1, y, 0}, {x + 1, y + 0.5f, 0.05f}, {x, y + 0.5f, 0.05f});
  }
  add_materials(scales);
  EXPECT_EQ(sheet_part(scales, 1), 0.0);
}

TEST(Walls, ASlantedRoofOfSingleSheetsIsOne) {
  Surface roof;
  for (int row = 0; row < 30; ++row) {
    for (int column = 0; column < 15; ++column) {
      const float x = static_cast<float>(column) + 0.5f * static_cast<float>(row % 2);
      const float s = 0.5f * static_cast<float>(row);
      const auto at = [&](float dx, float ds, float up) {
        return vec3(x + dx, 0.8f * (s + ds) - 0.6f * up, 0.6f * (s + ds) + 0.8f * up);
      };
      add_quad(roof, at(0.02f, 0, 0.1f), at(0.98f, 0, 0.1f), at(0.98f, 0.9f, 0), at(0.02f, 0.9f, 0));
    }
  }
  add_materials(roof);
  EXPECT_GT(wall_part(roof, 2), 0.95);
}

TEST(Walls, LeavesAndNeedlesAreNone) {
  LeafCloud cloud;
  cloud.count = 20000;  // dense: nothing is seen through it
  const Surface leaves = leaf_cloud(cloud);
  for (const double resolution : {0.02, 0.1, 0.3}) {
    EXPECT_EQ(part_of(WallKind::None, leaves, resolution), 1.0) << resolution;
  }
  Surface needles = make_tube(3, 1, 0.01f, 1.0f);
  EXPECT_EQ(part_of(WallKind::None, needles, 0.1), 1.0);
}

TEST(Walls, LeavesThatLieInALayerAtAllAnglesAreNone) {
  LeafCloud cloud;
  cloud.count = 20000;
  Surface layer = leaf_cloud(cloud);
  for (size_t i = 0; i + 2 < layer.positions.size() + 1; ++i) layer.positions[i].z += 0;
  for (const uvec3& t : layer.triangles) {
    const float z = layer.positions[t.x].z * 0.9f;  // what is left of a leaf's place along z is a tenth
    for (int c = 0; c < 3; ++c) layer.positions[t[c]].z -= z;
  }
  EXPECT_EQ(wall_part(layer, 0.3), 0.0);
}

TEST(Walls, WhatLetsLightThroughIsNone) {
  Surface boards = make_boards(0.02f);
  for (FaceMaterial& m : boards.materials) m.transmission = vec3(0.3f);
  EXPECT_EQ(wall_part(boards, 2), 0.0);
}

TEST(Walls, FacesWithoutAreaDoNoHarm) {
  Surface nothing;
  EXPECT_TRUE(find_walls(nothing, nothing, 1)->kinds.empty());
  Surface boards = make_boards(0.02f);
  boards.triangles.emplace_back(0, 1, 1);
  boards.materials.push_back(boards.materials[0]);
  const auto walls = find_walls(boards, nothing, 2);
  ASSERT_TRUE(walls);
  EXPECT_EQ(walls->kinds.back(), WallKind::None);
  EXPECT_EQ(walls->kinds.front(), WallKind::Closed);
}

TEST(WallShell, ClosesGapsAndKeepsTheSize) {
  const Surface boards = make_boards(0.1f);
  const auto shell = wrap_wall(boards, 2);
  ASSERT_TRUE(shell);
  const double plate = 2 * (19.9 * 20 + 19.9 * 0.2 + 20 * 0.2);
  EXPECT_NEAR(area_of(*shell) / plate, 1, 0.01);
  const Box3 want = boards.bounds(), is = shell->bounds();
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(is.lower[axis], want.lower[axis], 1e-4);
    EXPECT_NEAR(is.upper[axis], want.upper[axis], 1e-4);
  }
  const auto scene = RayScene::build(*shell);
  ASSERT_TRUE(scene);
  for (int i = 0; i < 400; ++i) {
    const float x = 0.3f + 0.048f * static_cast<float>(i);
    EXPECT_TRUE(scene->first_hit({x, 7.3f, 5}, {0, 0, -1}, 0, 10)) << x;
    EXPECT_TRUE(scene->first_hit({x, 7.3f, -5}, {0, 0, 1}, 0, 10)) << x;
  }
}

TEST(WallShell, HasTheMaterialsOfItsTwoSides) {
  Surface boards = make_boards(0.02f);
  for (size_t f = 0; f < boards.triangles.size(); ++f) {
    const uvec3& t = boards.triangles[f];
    const bool is_front = std::min({boards.positions[t.x].z, boards.positions[t.y].z, boards.positions[t.z].z}) > 0.1f;
    boards.materials[f].diffuse = is_front ? vec3(0.8f, 0, 0) : vec3(0, 0, 0.4f);
  }
  const auto shell = wrap_wall(boards, 2);
  ASSERT_TRUE(shell);
  double front = 0, back = 0, red = 0, blue = 0;
  for (size_t f = 0; f < shell->triangles.size(); ++f) {
    const TrianglePiece t = corners_of(*shell, f);
    const double area = glm::length(area_vector_of(t));
    if (std::min({t[0].z, t[1].z, t[2].z}) > 0.19) front += area, red += area * shell->materials[f].diffuse.x;
    if (std::max({t[0].z, t[1].z, t[2].z}) < 0.01) back += area, blue += area * shell->materials[f].diffuse.z;
  }
  EXPECT_NEAR(red / front, 0.79, 0.02);
  EXPECT_NEAR(blue / back, 0.395, 0.01);
}

/// Sheets without thickness let the same share through in all directions.
TEST(WallShell, OfSheetsHasTheShareOfTheirGaps) {
  for (const float gap : {0.04f, 0.12f}) {
    Surface sheets;
    for (int i = 0; i < 20; ++i) {
      const auto x = static_cast<float>(i);
      add_quad(sheets, {x, 0, 0}, {x + 1 - gap, 0, 0}, {x + 1 - gap, 20, 0}, {x, 20, 0});
    }
    add_materials(sheets);
    const auto shell = wrap_wall(sheets, 2);
    ASSERT_TRUE(shell);
    double area = 0, open = 0;
    for (size_t f = 0; f < shell->triangles.size(); ++f) {
      const double of_face = glm::length(area_vector_of(corners_of(*shell, f)));
      area += of_face, open += of_face * shell->materials[f].gap;
    }
    EXPECT_NEAR(open / area, gap, 0.15 * gap + 0.003);
  }
}

TEST(WallShell, OfDeepNarrowGapsHasNone) {
  const auto shell = wrap_wall(make_boards(0.02f), 2);
  ASSERT_TRUE(shell);
  for (const FaceMaterial& m : shell->materials) EXPECT_EQ(m.gap, 0);
}

TEST(Walls, AreFoundAgainWhereTheirSurfaceWas) {
  const Surface boards = make_boards(0.05f);
  const auto shell = wrap_wall(boards, 2);
  ASSERT_TRUE(shell);
  std::vector<uint8_t> is_left(shell->triangles.size());
  for (size_t f = 0; f < is_left.size(); ++f) is_left[f] = shell->positions[shell->triangles[f].x].x < 8;
  const auto is_near = find_near(boards, *shell, is_left, 1);
  for (size_t f = 0; f < is_near.size(); ++f) {
    const float x = boards.positions[boards.triangles[f].x].x;
    if (x < 7 || x > 12) {
      EXPECT_EQ(is_near[f], x < 7) << x;
    }
  }
}

/// Closed boards without gaps: nothing is lost between them.
TEST(WallShell, TouchingBoardsKeepTheirColour) {
  const Surface boards = make_boards(0.0f);
  const auto shell = wrap_wall(boards, 2);
  ASSERT_TRUE(shell);
  for (size_t f = 0; f < shell->triangles.size(); ++f) {
    if (glm::length(area_vector_of(corners_of(*shell, f))) < 1e-3) continue;  // rays at an edge may take either side
    EXPECT_NEAR(shell->materials[f].diffuse.x, 0.5f, 1e-5f);
  }
}

TEST(WallShell, IsTheSameForAnyNumberOfThreads) {
  const Surface boards = make_boards(0.05f);
  const auto many = wrap_wall(boards, 2);
  const ThreadLimit one(1);
  const auto single = wrap_wall(boards, 2);
  ASSERT_TRUE(many && single);
  EXPECT_EQ(many->positions, single->positions);
  EXPECT_EQ(many->triangles, single->triangles);
  for (size_t f = 0; f < many->materials.size(); ++f) {
    EXPECT_EQ(many->materials[f].diffuse, single->materials[f].diffuse);
    EXPECT_EQ(many->materials[f].sggx, single->materials[f].sggx);
  }
}

}  // namespace
}  // namespace farfield
