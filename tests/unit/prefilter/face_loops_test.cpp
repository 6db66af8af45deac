// SPDX-License-Identifier: Apache-2.0
#include "prefilter/face_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace farfield {
namespace {

/// nu x nv quads; optionally closed in u, in v.
QuadMesh make_quad_grid(uint32_t nu, uint32_t nv, bool closed_u, bool closed_v) {
  const uint32_t columns = closed_u ? nu : nu + 1, rows = closed_v ? nv : nv + 1;
  const auto vertex = [&](uint32_t i, uint32_t j) { return j % rows * columns + i % columns; };
  std::vector<PolygonCorners> faces;
  for (uint32_t j = 0; j < nv; ++j) {
    for (uint32_t i = 0; i < nu; ++i) {
      faces.emplace_back(vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
    }
  }
  return QuadMesh(std::move(faces), columns * rows);
}

/// Two quads follow each other across the rung between them, and rungs are the quads' edges.
void expect_connected(const QuadMesh& mesh, const FaceLoop& loop) {
  ASSERT_EQ(loop.rungs.size(), loop.quads.size() + (loop.is_closed ? 0 : 1));
  for (size_t i = 0; i < loop.quads.size(); ++i) {
    const Rung &from = loop.rungs[i], &to = loop.rungs[(i + 1) % loop.rungs.size()];
    const int a = mesh.edge_corner(loop.quads[i], from.left, from.right);
    const int b = mesh.edge_corner(loop.quads[i], to.left, to.right);
    ASSERT_GE(a, 0);
    ASSERT_EQ(b, (a + 2) % 4);
    const bool is_last = i + 1 == loop.rungs.size();
    if (is_last && loop.is_twisted) continue;
    EXPECT_GE(mesh.edge_corner(loop.quads[i], from.left, to.left), 0);  // sides stay on their side
    EXPECT_GE(mesh.edge_corner(loop.quads[i], from.right, to.right), 0);
  }
}

/// How many loops there are of each length; negative: of closed ones. Each quad must be passed twice.
std::map<int, int> lengths(const QuadMesh& mesh) {
  std::map<int, int> result;
  std::vector<int> passes(mesh.face_count(), 0);
  for (const FaceLoop& loop : find_face_loops(mesh)) {
    expect_connected(mesh, loop);
    ++result[loop.is_closed ? -static_cast<int>(loop.quads.size()) : static_cast<int>(loop.quads.size())];
    for (const uint32_t quad : loop.quads) ++passes[quad];
  }
  for (uint32_t f = 0; f < mesh.face_count(); ++f) EXPECT_EQ(passes[f], mesh.is_quad(f) ? 2 : 0);
  return result;
}

TEST(FaceLoops, OfAGridEndAtItsBorders) {
  const QuadMesh grid = make_quad_grid(5, 3, false, false);
  EXPECT_EQ(lengths(grid), (std::map<int, int>{{5, 3}, {3, 5}}));
  for (const FaceLoop& loop : find_face_loops(grid)) {
    EXPECT_EQ(loop.before, kNoIndex);
    EXPECT_EQ(loop.after, kNoIndex);
  }
}

TEST(FaceLoops, OfATubeAreClosedAroundIt) {
  EXPECT_EQ(lengths(make_quad_grid(6, 4, true, false)), (std::map<int, int>{{-6, 4}, {4, 6}}));
}

TEST(FaceLoops, OfATorusAreAllClosed) {
  EXPECT_EQ(lengths(make_quad_grid(6, 4, true, true)), (std::map<int, int>{{-6, 4}, {-4, 6}}));
}

TEST(FaceLoops, OfACubeGoAroundItInThreeDirections) {
  const QuadMesh cube({{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}, 8);
  EXPECT_EQ(lengths(cube), (std::map<int, int>{{-4, 3}}));
}

TEST(FaceLoops, TheSameWhicheverQuadTheyAreFoundFrom) {
  const QuadMesh grid = make_quad_grid(5, 3, false, false);
  for (uint32_t quad = 5; quad < 10; ++quad) {
    for (const int corner : {1, 3}) {
      const FaceLoop loop = trace_loop(grid, quad, corner);
      EXPECT_EQ(loop.quads.size(), 5u);
      EXPECT_EQ(loop.quads.front(), corner == 3 ? 5u : 9u);
      expect_connected(grid, loop);
    }
  }
}

TEST(FaceLoops, EndAtTriangles) {
  // A triangle, two quads, and nothing.
  const QuadMesh strip({{0, 1, 2, kNoIndex}, {1, 3, 4, 2}, {3, 5, 6, 4}}, 7);
  const FaceLoop loop = trace_loop(strip, 2, strip.edge_corner(2, 3, 4));
  EXPECT_EQ(loop.quads.size(), 2u);
  EXPECT_EQ(std::minmax(loop.before, loop.after), std::minmax(0u, kNoIndex));
  expect_connected(strip, loop);
}

TEST(FaceLoops, EndWhereThreeQuadsMeetAtAnEdge) {
  const QuadMesh fan({{0, 1, 2, 3}, {0, 1, 4, 5}, {0, 1, 6, 7}}, 8);
  const FaceLoop loop = trace_loop(fan, 0, 0);
  EXPECT_EQ(loop.quads.size(), 1u);
  EXPECT_EQ(std::minmax(loop.before, loop.after), std::minmax(kNoIndex, QuadMesh::kNotManifold));
}

TEST(FaceLoops, PassTwiceThroughAQuadWhereTheyCrossThemselves) {
  // Out of quad 0 to the east, around the square in the middle (5), and back into it from the north.
  const QuadMesh mesh({{0, 1, 2, 3}, {1, 7, 4, 2}, {7, 8, 5, 4}, {8, 9, 6, 5}, {9, 3, 2, 6}, {2, 4, 5, 6}}, 10);
  const FaceLoop loop = trace_loop(mesh, 0, 3);
  EXPECT_EQ(loop.quads, (std::vector<uint32_t>{0, 1, 2, 3, 4, 0}));
  EXPECT_EQ(loop.rungs.front().left, 3u);  // where it comes in from the west
  EXPECT_EQ(loop.rungs.back().right, 0u);  // and goes out to the south
  EXPECT_FALSE(loop.is_closed);
  // Through the square in the middle two loops, each from border to border.
  EXPECT_EQ(lengths(mesh), (std::map<int, int>{{6, 1}, {3, 2}}));
}

TEST(FaceLoops, LieBesideThemselvesOnAHelix) {
  // A row of quads that is wound up, 5 to a turn: what is left of one turn is right of the next.
  std::vector<PolygonCorners> faces;
  for (uint32_t k = 0; k < 15; ++k) faces.emplace_back(k, k + 1, k + 6, k + 5);
  const QuadMesh helix(std::move(faces), 21);
  const FaceLoop loop = trace_loop(helix, 7, helix.edge_corner(7, 7, 12));
  EXPECT_EQ(loop.quads.size(), 15u);
  expect_connected(helix, loop);
  EXPECT_EQ(std::ranges::count_if(loop.rungs, [](const Rung& rung) { return rung.left == 10 || rung.right == 10; }), 2);
}

TEST(FaceLoops, AreTwistedOnAMoebiusStrip) {
  const QuadMesh strip({{0, 2, 3, 1}, {2, 4, 5, 3}, {4, 1, 0, 5}}, 6);
  const FaceLoop loop = trace_loop(strip, 0, strip.edge_corner(0, 0, 1));
  EXPECT_TRUE(loop.is_closed);
  EXPECT_TRUE(loop.is_twisted);
  EXPECT_EQ(loop.quads.size(), 3u);
}

TEST(FaceLoops, DoNotCareHowQuadsAreWound) {
  const QuadMesh mixed({{0, 1, 4, 3}, {1, 4, 5, 2}}, 6);  // the second one the other way round
  const FaceLoop loop = trace_loop(mixed, 0, mixed.edge_corner(0, 0, 3));
  EXPECT_EQ(loop.quads.size(), 2u);
  expect_connected(mixed, loop);
}

}  // namespace
}  // namespace farfield
