// SPDX-License-Identifier: Apache-2.0
#include "prefilter/cut_tile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "prefilter/edge_table.h"
#include "prefilter/keep_apart.h"
#include "prefilter/simplify.h"
#include "tests/support/files.h"
#include "tests/support/source_surfaces.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using Point = std::array<float, 3>;
using Segment = std::pair<Point, Point>;

Point point(const vec3& p) { return {p.x, p.y, p.z}; }

Surface hills(int columns, int rows) {
  return test::make_grid(columns, rows, false,
                         [](float u, float v) { return vec3(u, v, 0.02f * std::sin(17 * u) * std::cos(11 * v)); });
}

/// Edges of one face, by their ends.
std::set<Segment> border_of(const std::vector<vec3>& positions, const std::vector<uvec3>& triangles) {
  const EdgeTable edges = build_edge_table(triangles, positions.size());
  std::set<Segment> border;
  for (uint32_t e = 0; e < edges.size(); ++e) {
    if (edges.faces_of(e).size() != 1) continue;
    const Point a = point(positions[edges.smaller_vertex[e]]), b = point(positions[edges.larger_vertex[e]]);
    border.emplace(std::min(a, b), std::max(a, b));
  }
  return border;
}

std::set<Segment> without(const std::set<Segment>& from, const std::set<Segment>& what) {
  std::set<Segment> rest;
  std::ranges::set_difference(from, what, std::inserter(rest, rest.end()));
  return rest;
}

TEST(CutTile, EachFaceIsInJustOneTileWithAllThatIsItsOwn) {
  SourceSurface whole = test::source_of(hills(37, 23));
  for (size_t t = 0; t < whole.triangles.size(); ++t) {
    for (int c = 0; c < 3; ++c) {
      const vec3& p = whole.positions[whole.triangles[t][c]];
      whole.corner_uv.emplace_back(p.x, p.y);
      whole.corner_normal.push_back(glm::normalize(vec3(p.x, p.y, 1)));
      whole.corner_color.emplace_back(p, 1);
    }
  }
  for (const uint32_t count : {2u, 3u, 16u, 64u}) {
    std::vector<int> seen(whole.triangles.size(), 0);
    size_t fewest = whole.triangles.size(), most = 0;
    for (uint32_t number = 0; number < count; ++number) {
      const SourceSurface tile = cut_tile(whole, {number, count});
      fewest = std::min(fewest, tile.triangles.size());
      most = std::max(most, tile.triangles.size());
      ASSERT_EQ(tile.corner_uv.size(), 3 * tile.triangles.size());
      for (size_t t = 0; t < tile.triangles.size(); ++t) {
        const uint32_t face = tile.source_face[t];
        ++seen[face];
        for (int c = 0; c < 3; ++c) {
          const size_t corner = 3 * t + static_cast<size_t>(c), of_whole = 3 * face + static_cast<size_t>(c);
          ASSERT_EQ(tile.positions[tile.triangles[t][c]], whole.positions[whole.triangles[face][c]]);
          ASSERT_EQ(tile.corner_uv[corner], whole.corner_uv[of_whole]);
          ASSERT_EQ(tile.corner_normal[corner], whole.corner_normal[of_whole]);
          ASSERT_EQ(tile.corner_color[corner], whole.corner_color[of_whole]);
        }
      }
    }
    EXPECT_TRUE(std::ranges::all_of(seen, [](int times) { return times == 1; })) << count;
    EXPECT_LE(most, 3 * fewest) << count << ": cuts go between rows, so tiles are not quite alike";
  }
}

TEST(CutTile, CutsBetweenTheRowsOfAGrid) {
  const SourceSurface whole = test::source_of(test::make_plane(64, 64, 1, 1));
  const SourceSurface tile = cut_tile(whole, {0, 16});
  EXPECT_EQ(tile.triangles.size(), 2u * 16 * 16);
  EXPECT_EQ(std::ranges::count(tile.on_cut, 1), 2 * 16 + 1) << "two sides of a corner tile, without teeth";
}

TEST(CutTile, KnowsWhatItSharesWithOthers) {
  const SourceSurface whole = test::source_of(hills(30, 30));
  std::map<Point, int> tiles_at;
  std::vector<SourceSurface> tiles;
  for (uint32_t number = 0; number < 8; ++number) {
    tiles.push_back(cut_tile(whole, {number, 8}));
    for (const vec3& p : tiles.back().positions) ++tiles_at[point(p)];
  }
  for (const SourceSurface& tile : tiles)
    for (size_t v = 0; v < tile.positions.size(); ++v)
      ASSERT_EQ(tile.on_cut[v] != 0, tiles_at[point(tile.positions[v])] > 1);
}

TEST(CutTile, OfFacesInOnePlaceOrOfTooFewIsStillDetermined) {
  Surface stack;  // all begin in the same place
  stack.positions = {{0, 0, 0}, {1, 0, 0}};
  for (int i = 0; i < 8; ++i) {
    stack.positions.emplace_back(0.0f, 1.0f, static_cast<float>(i));
    stack.triangles.emplace_back(0, 1, i + 2);
  }
  test::add_materials(stack);
  const SourceSurface whole = test::source_of(stack);
  size_t faces = 0;
  for (uint32_t number = 0; number < 8; ++number) faces += cut_tile(whole, {number, 8}).triangles.size();
  EXPECT_EQ(faces, 8u);
  EXPECT_TRUE(cut_tile(whole, {0, 9}).triangles.empty());
}

TEST(CutTile, HasNoTexturesOfOtherTiles) {
  SourceSurface whole = test::source_of(test::make_plane(16, 16, 1, 1));
  whole.materials.resize(2);
  for (SourceMaterial& material : whole.materials)
    material.base_color_map.image = std::make_shared<Texture>(1, 1, std::vector<vec4>{vec4(1)});
  for (size_t t = 0; t < whole.triangles.size(); ++t)
    whole.material[t] =
        whole.positions[whole.triangles[t].x].x >= 0.5f || whole.positions[whole.triangles[t].y].x > 0.5f;
  const SourceSurface first = cut_tile(whole, {0, 2}), second = cut_tile(whole, {1, 2});
  const SourceSurface& left = first.material[0] == 0 ? first : second;
  ASSERT_EQ(left.materials.size(), 2u) << "materials keep their numbers";
  EXPECT_TRUE(left.materials[left.material[0]].base_color_map);
  EXPECT_FALSE(left.materials[1 - left.material[0]].base_color_map);
}

/// Two tiles as they are at two levels: resolved at r, simplified at r and again at 4 r.
struct Levels {
  Surface fine, coarse;
};
Levels levels_of(const SourceSurface& tile, float resolution) {
  const ResolvedSurface resolved = resolve(tile, resolution).value();
  const CutPoints cut(tile, resolved);
  const auto simplified = [&](const Surface& surface, float r) {
    SimplifyResult result = simplify(surface, {.resolution = r, .is_pinned = cut.find(surface.positions)});
    EXPECT_TRUE(keep_apart(surface, r, result, cut.find(result.surface.positions)));
    return result.surface;
  };
  Levels levels;
  levels.fine = simplified(resolved.surface, resolution);
  levels.coarse = simplified(levels.fine, 4 * resolution);
  return levels;
}

TEST(CutTile, NeighboursMeetWithoutCracksAtDifferentLevels) {
  const Surface surface = hills(64, 64);
  const SourceSurface whole = test::source_of(surface);
  const std::set<Segment> rim = border_of(surface.positions, surface.triangles);
  const SourceSurface left = cut_tile(whole, {0, 2}), right = cut_tile(whole, {1, 2});
  const std::set<Segment> cut = without(border_of(left.positions, left.triangles), rim);
  ASSERT_EQ(cut.size(), 64u);
  for (const SourceSurface* tile : {&left, &right}) {
    const Levels levels = levels_of(*tile, 0.05f);
    EXPECT_LT(levels.coarse.triangles.size(), tile->triangles.size() / 8) << "a tile is simplified all the same";
    EXPECT_LT(levels.coarse.triangles.size(), levels.fine.triangles.size());
    for (const Surface* level : {&levels.fine, &levels.coarse}) {
      const std::set<Segment> border = border_of(level->positions, level->triangles);
      EXPECT_TRUE(std::ranges::includes(border, cut));
    }
  }
}

TEST(CutTile, NeighboursMeetWhereDetailSplitsTheCut) {
  // Colours that change fast: resolve() bisects faces, so edges of the cut get vertices that the source has not.
  SourceSurface whole = test::source_of(test::make_plane(4, 4, 1, 1));
  whole.material_function = {};
  whole.materials[0].base_color = vec3(1.0f);
  for (size_t t = 0; t < whole.triangles.size(); ++t)
    for (int c = 0; c < 3; ++c) whole.corner_color.emplace_back(c == 0 ? 0.0f : 1.0f, 0.5f, 0.5f, 1.0f);
  for (const uint32_t number : {0u, 1u}) {
    const SourceSurface tile = cut_tile(whole, {number, 2});
    const ResolvedSurface resolved = resolve(tile, 0.06f).value();
    ASSERT_GT(resolved.surface.triangles.size(), 8 * tile.triangles.size());
    const std::vector<uint8_t> is_cut = CutPoints(tile, resolved).find(resolved.surface.positions);
    size_t split = 0;
    for (size_t v = 0; v < is_cut.size(); ++v) {
      const vec3& p = resolved.surface.positions[v];
      const bool continues_it = (p.y == 0 || p.y == 1) && std::abs(p.x - 0.5f) < 0.25f;  // on the edge at its end
      if (!continues_it) {
        EXPECT_EQ(is_cut[v] != 0, p.x == 0.5f) << p.x << ' ' << p.y;
      }
      split += is_cut[v] && std::abs(4 * p.y - std::round(4 * p.y)) > 1e-3f;
    }
    EXPECT_GT(split, 4u);
  }
}

TEST(CutTile, WithoutTilesNothingIsPinned) {
  const SourceSurface whole = test::source_of(hills(8, 8));
  const ResolvedSurface resolved = resolve(whole, 0.1f).value();
  EXPECT_TRUE(CutPoints(whole, resolved).find(resolved.surface.positions).empty());
}

TEST(ImportAsset, GivesTilesOfAMeshThatIsReadOnce) {
  const test::TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 20; ++i) text += "v " + std::to_string(i) + " 0 0\nv " + std::to_string(i) + " 1 0\n";
  for (int i = 1; i < 39; i += 2) {
    const auto n = [&](int k) { return std::to_string(i + k); };
    text += "f " + n(0) + " " + n(2) + " " + n(3) + " " + n(1) + "\n";
  }
  text += "f 1 2 1\n";  // without area: a warning
  const auto path = folder.write("strip.obj", text);
  KnownMesh known;
  ImportOptions options;
  options.known_mesh = &known;
  std::set<uint64_t> hashes;
  size_t faces = 0, warnings = 0;
  for (uint32_t number = 0; number < 4; ++number) {
    options.tile = {number, 4};
    const auto tile = import_asset(path, options);
    ASSERT_TRUE(tile) << tile.error().message;
    EXPECT_EQ(tile->source_hash, hash_source(path, tile->source_files, options).value());
    hashes.insert(tile->source_hash);
    faces += tile->source.triangles.size();
    warnings += tile->warnings.size();
  }
  EXPECT_EQ(hashes.size(), 4u);
  EXPECT_EQ(faces, 38u);
  EXPECT_EQ(warnings, 1u) << "said once, not by each tile";
  options.tile = {0, 100};
  const auto too_many = import_asset(path, options);
  ASSERT_FALSE(too_many);
  EXPECT_NE(too_many.error().message.find("38 faces make no 100 tiles"), std::string::npos);
}

}  // namespace
}  // namespace farfield
