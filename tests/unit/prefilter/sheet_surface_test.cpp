// SPDX-License-Identifier: Apache-2.0
#include "prefilter/sheet_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/parallel.h"
#include "base/random.h"
#include "prefilter/ray_scene.h"
#include "prefilter/sheet_mesh.h"
#include "prefilter/triangle_pieces.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using namespace test;

/// Of 40 x 20, along y, 1 apart; without thickness if deep == 0.
Surface make_boards(float wide, float deep) {
  Surface boards;
  constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (int i = 0; i < 40; ++i) {
    const auto first = static_cast<uint32_t>(boards.positions.size());
    for (int c = 0; c < 8; ++c) {
      boards.positions.push_back(
          {static_cast<float>(i) + (c & 1 ? wide : 0), c & 2 ? 20.0f : 0.0f, c & 4 ? deep : 0.0f});
    }
    for (int side = 0; side < (deep > 0 ? 6 : 1); ++side) {
      const auto corner = [&](int k) { return first + static_cast<uint32_t>(kSides[side][k]); };
      boards.triangles.emplace_back(corner(0), corner(1), corner(2));
      boards.triangles.emplace_back(corner(0), corner(2), corner(3));
    }
  }
  add_materials(boards);
  return boards;
}

double area_of_face(const Surface& surface, size_t face) {
  return 0.5 * glm::length(area_vector_of(corners_of(surface, face)));
}

double area_of(const Surface& surface) {
  double area = 0;
  for (size_t f = 0; f < surface.triangles.size(); ++f) area += area_of_face(surface, f);
  return area;
}

/// The mean share of rays along w that the sheet stops, by area.
double stopped_share(const Surface& sheet, const vec3& w) {
  double stopped = 0;
  for (size_t f = 0; f < sheet.triangles.size(); ++f) {
    const vec3 n(glm::normalize(area_vector_of(corners_of(sheet, f))));
    stopped += area_of_face(sheet, f) * static_cast<double>(sheet.materials[f].stopped_share(n, w));
  }
  return stopped / area_of(sheet);
}

TEST(SheetMesh, ReachesAsFarAsItsPieces) {
  for (const float turn : {0.0f, 0.7f}) {
    Surface boards = make_boards(0.5f, 0.3f);
    for (vec3& p : boards.positions) {
      p = {p.x, std::cos(turn) * p.y - std::sin(turn) * p.z, std::sin(turn) * p.y + std::cos(turn) * p.z};
    }
    const Surface mesh = make_sheet_mesh(boards, 2);
    EXPECT_NEAR(area_of(mesh) / (39.5 * 20), 1, 0.005) << turn;
    EXPECT_LT(mesh.triangles.size(), 4000u);
    const vec3 normal(0, -std::sin(turn), std::cos(turn));
    for (const vec3& p : mesh.positions) EXPECT_NEAR(glm::dot(p, normal), 0.15f, 0.01f);
  }
}

TEST(SheetMesh, OfACurvedLayerHasNoHoles) {
  Surface staves;
  for (int i = 0; i < 60; ++i) {
    const auto at = [&](float turn, float height) {
      return vec3(10 * std::cos(0.05f * turn), 10 * std::sin(0.05f * turn), height);
    };
    const auto first = static_cast<uint32_t>(staves.positions.size()), k = static_cast<uint32_t>(i);
    const auto from = static_cast<float>(k), to = from + 0.5f;
    staves.positions.insert(staves.positions.end(), {at(from, 0), at(to, 0), at(to, 15), at(from, 15)});
    staves.triangles.emplace_back(first, first + 1, first + 2);
    staves.triangles.emplace_back(first, first + 2, first + 3);
  }
  add_materials(staves);
  const Surface mesh = make_sheet_mesh(staves, 1);
  EXPECT_NEAR(area_of(mesh) / (10 * 0.05 * 59.5 * 15), 1, 0.01);
}

/// Against rays at the boards themselves, of which 20000 know the share within 0.0035; 4 of these, and 1 % for the
/// sheet's own rays and what rims are.
TEST(SheetSurface, StopsAsManyRaysAsItsPiecesFromEverywhere) {
  for (const auto& [wide, deep] : {std::pair(0.5f, 0.5f), {0.3f, 0.2f}, {0.7f, 0.0f}}) {
    const Surface boards = make_boards(wide, deep);
    const auto sheet = lay_sheet(boards, 2);
    ASSERT_TRUE(sheet);
    const auto scene = RayScene::build(boards);
    ASSERT_TRUE(scene);
    Rng rng(3);
    for (const vec3& to : {vec3(0, 0, 1), vec3(1, 0, 1), vec3(0, 1, 1), vec3(-0.3f, 0.4f, -1), vec3(2, 1, 1)}) {
      const vec3 w = glm::normalize(to);
      int stopped = 0;
      constexpr int kRays = 20000;
      for (int i = 0; i < kRays; ++i) {
        const vec3 at(5 + 30 * rng.next(), 5 + 10 * rng.next(), 0.5f * deep);
        stopped += scene->is_occluded(at - 10.0f * w, w, 0, 20);
      }
      EXPECT_NEAR(stopped_share(*sheet, w), stopped / double(kRays), 0.025) << wide << ' ' << to.x << ' ' << to.y;
    }
  }
}

TEST(SheetSurface, HasTheShareOfItsGapsWithinItsStandardError) {
  for (const float wide : {0.01f, 0.25f, 0.5f, 0.9f}) {
    const auto sheet = lay_sheet(make_boards(wide, 0.0f), 2);
    ASSERT_TRUE(sheet);
    const double covered = 40 * wide / (39 + static_cast<double>(wide));
    constexpr double kRays = 1 << 17;  // at least
    EXPECT_NEAR(stopped_share(*sheet, {0, 0, 1}), covered, 4 * std::sqrt(covered * (1 - covered) / kRays) + 1e-3)
        << wide;
  }
}

TEST(SheetSurface, WithoutGapsStopsEverything) {
  const auto sheet = lay_sheet(make_boards(1.0f, 0.2f), 2);
  ASSERT_TRUE(sheet);
  EXPECT_GT(stopped_share(*sheet, {0, 0, 1}), 0.999);
  EXPECT_GT(stopped_share(*sheet, glm::normalize(vec3(1, 2, 1))), 0.999);
}

TEST(SheetSurface, OneVoxelWideOrOfNothingDoesNoHarm) {
  Surface strip = make_boards(0.5f, 0.2f);
  for (vec3& p : strip.positions) p.y *= 0.05f;
  const auto sheet = lay_sheet(strip, 2);
  ASSERT_TRUE(sheet);
  for (const vec3& p : sheet->positions) EXPECT_TRUE(std::isfinite(p.x + p.y + p.z));
  EXPECT_LT(area_of(*sheet), 1.2 * 39.5);
  const auto nothing = lay_sheet(Surface{}, 2);
  ASSERT_TRUE(nothing);
  EXPECT_TRUE(nothing->triangles.empty());
}

/// Fronts catch no light, sides do; colours are those of the pieces.
TEST(SheetSurface, KeepsTheColourOfFronts) {
  const auto sheet = lay_sheet(make_boards(0.5f, 0.4f), 2);
  ASSERT_TRUE(sheet);
  for (const FaceMaterial& m : sheet->materials) {
    EXPECT_NEAR(m.diffuse.x, 0.5f, 0.01f);
    EXPECT_GT(m.sheet.edge, 0.7f);
    EXPECT_GT(m.sheet.caught, 0.2f);
    EXPECT_LT(m.sheet.caught, 0.6f);
  }
}

TEST(SheetSurface, IsTheSameForAnyNumberOfThreads) {
  const Surface boards = make_boards(0.5f, 0.2f);
  const auto many = lay_sheet(boards, 2);
  const ThreadLimit one(1);
  const auto single = lay_sheet(boards, 2);
  ASSERT_TRUE(many && single);
  EXPECT_EQ(many->positions, single->positions);
  EXPECT_EQ(many->triangles, single->triangles);
  for (size_t f = 0; f < many->materials.size(); ++f) {
    EXPECT_EQ(many->materials[f].gap, single->materials[f].gap);
    EXPECT_EQ(many->materials[f].sheet, single->materials[f].sheet);
    EXPECT_EQ(many->materials[f].sggx, single->materials[f].sggx);
    EXPECT_EQ(many->materials[f].diffuse, single->materials[f].diffuse);
  }
}

}  // namespace
}  // namespace farfield
