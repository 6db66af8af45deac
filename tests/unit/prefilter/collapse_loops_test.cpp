// SPDX-License-Identifier: Apache-2.0
#include "prefilter/collapse_loops.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <numeric>

#include "base/index.h"
#include "base/parallel.h"
#include "evaluate/nearest_point_grid.h"
#include "tests/support/simplified_surface.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using namespace test;

Surface with_quads(Surface surface) {
  pair_into_quads(surface);
  return surface;
}

/// Both halves of each quad are there and share an edge: its diagonal.
void expect_quads_whole(const Surface& surface) {
  ASSERT_EQ(surface.quad.size(), surface.triangles.size());
  std::map<uint32_t, std::vector<uint32_t>> halves;
  for (uint32_t f = 0; f < surface.quad.size(); ++f) {
    if (surface.quad[f] != kNoIndex) halves[surface.quad[f]].push_back(f);
  }
  for (const auto& [quad, faces] : halves) {
    ASSERT_EQ(faces.size(), 2u);
    const uvec3 &a = surface.triangles[faces[0]], &b = surface.triangles[faces[1]];
    int shared = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) shared += a[i] == b[j];
    }
    EXPECT_EQ(shared, 2);
  }
}

size_t count_halves(const Surface& surface) {
  return static_cast<size_t>(std::ranges::count_if(surface.quad, [](uint32_t quad) { return quad != kNoIndex; }));
}

/// The farther of the distances of either surface's points (corners and middles of faces) from the other.
double two_sided_distance(const Surface& a, const Surface& b) {
  double farthest = 0;
  for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    const NearestPointGrid nearest(*to);
    for (const uvec3& t : from->triangles) {
      const vec3 &p = from->positions[t.x], &q = from->positions[t.y], &r = from->positions[t.z];
      for (const vec3& point : {p, q, r, 0.5f * (p + q), (p + q + r) / 3.0f}) {
        farthest = std::max(farthest, nearest.distance(point));
      }
    }
  }
  return farthest;
}

/// No face has turned over or lost its area: its normal still looks the way of the face it came from.
void expect_no_face_turned(const Surface& before, const SimplifyResult& result) {
  const auto normal = [](const Surface& surface, size_t face) {
    const uvec3& t = surface.triangles[face];
    const dvec3 a(surface.positions[t.x]), b(surface.positions[t.y]), c(surface.positions[t.z]);
    return glm::cross(b - a, c - a);
  };
  for (size_t f = 0; f < before.triangles.size(); ++f) {
    if (result.face_map[f] == kMorphCollapsed) continue;
    EXPECT_GT(glm::dot(normal(before, f), normal(result.surface, result.face_map[f])), 0.0) << f;
  }
}

/// A plane disk of quads with a loop that crosses itself: the mesh of FaceLoops.PassTwice..., and a ring around it.
Surface make_crossing() {
  Surface surface;
  for (const vec2 p : {vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 1), vec2(2, 1), vec2(2, 2), vec2(1, 2), vec2(3, 0),
                       vec2(3, 3), vec2(0, 3)}) {
    surface.positions.emplace_back(p, 0.0f);
  }
  std::vector<uvec4> quads = {{0, 1, 2, 3}, {1, 7, 4, 2}, {7, 8, 5, 4}, {8, 9, 6, 5}, {9, 3, 2, 6}, {2, 4, 5, 6}};
  const std::vector<uint32_t> rim = {0, 1, 7, 8, 9, 3};
  for (const uint32_t v : rim) surface.positions.push_back(vec3(1.5f, 1.5f, 0) * -4.0f + 5.0f * surface.positions[v]);
  for (uint32_t i = 0; i < 6; ++i) quads.emplace_back(10 + i, 10 + (i + 1) % 6, rim[(i + 1) % 6], rim[i]);
  for (const uvec4& q : quads) {
    surface.triangles.emplace_back(q.x, q.y, q.z);
    surface.triangles.emplace_back(q.z, q.w, q.x);
  }
  add_materials(surface);
  return with_quads(surface);
}

/// A tube whose rows are one row that is wound up.
Surface make_helix(uint32_t per_turn, uint32_t turns) {
  Surface surface;
  for (uint32_t k = 0; k <= per_turn * (turns + 1); ++k) {
    const float angle = 2 * kPi * static_cast<float>(k) / static_cast<float>(per_turn);
    surface.positions.emplace_back(std::cos(angle), std::sin(angle), 0.04f * angle);
  }
  for (uint32_t k = 0; k < per_turn * turns; ++k) {
    surface.triangles.emplace_back(k, k + 1, k + 1 + per_turn);
    surface.triangles.emplace_back(k, k + 1 + per_turn, k + per_turn);
  }
  add_materials(surface);
  return with_quads(surface);
}

std::vector<Surface> quad_meshes() {
  return {with_quads(make_plane(40, 30, 1.0f, 1.0f)),
          with_quads(make_tube(40, 40, 0.5f, 2.0f)),
          with_quads(make_torus(80, 30, 0.3f)),
          with_quads(make_sphere(60, 30, 1.0f)),
          with_quads(make_rounded_cube(20, 0.3f)),
          with_quads(make_rounded_cube(8, 0.0f)),
          make_crossing(),
          make_helix(30, 6)};
}

TEST(CollapseLoops, QuadsStayQuadsAndManifoldsStayWhatTheyAre) {
  for (const Surface& surface : quad_meshes()) {
    const Topology before = topology_of(surface);
    ASSERT_EQ(before.nonmanifold_edges + before.nonmanifold_vertices, 0u);
    for (const float resolution : {0.1f, 0.4f, 13.0f, 100.0f}) {
      const SimplifyResult result = collapse_loops(surface, resolution).simplified;
      expect_valid(surface, result);
      expect_quads_whole(result.surface);
      expect_no_face_turned(surface, result);
      const Topology after = topology_of(result.surface);
      EXPECT_EQ(after.euler, before.euler);
      EXPECT_EQ(after.borders, before.borders);
      EXPECT_EQ(after.nonmanifold_edges, 0u);
      EXPECT_EQ(after.nonmanifold_vertices, 0u);
    }
  }
}

TEST(CollapseLoops, TheTwoSidedDistanceStaysBelowAQuarterOfTheResolution) {
  for (const Surface& surface : quad_meshes()) {
    for (const float resolution : {0.1f, 0.4f}) {
      const Surface result = collapse_loops(surface, resolution).simplified.surface;
      EXPECT_LE(two_sided_distance(surface, result), 0.25 * resolution + 1e-6);
    }
  }
}

TEST(CollapseLoops, RegularMeshesBecomeAsCoarseAsTheResolution) {
  const std::vector<Surface> surfaces = {with_quads(make_plane(64, 64, 1.0f, 1.0f)),
                                         with_quads(make_torus(160, 48, 0.3f)),
                                         with_quads(make_rounded_cube(64, 0.4f))};
  const std::vector<float> resolutions = {0.25f, 0.4f, 0.5f};
  for (size_t i = 0; i < surfaces.size(); ++i) {
    const Surface result = collapse_loops(surfaces[i], resolutions[i]).simplified.surface;
    const double area = total_area(surfaces[i]);
    const double side = std::sqrt(area / static_cast<double>(count_halves(result) / 2)) / resolutions[i];
    EXPECT_GT(side, 0.36);
    EXPECT_LT(side, 0.8);
    EXPECT_NEAR(total_area(result), area, 0.005 * area);
  }
}

TEST(CollapseLoops, ALoopThatCrossesItselfCollapsesWithItsCrossing) {
  const Surface surface = make_crossing();
  const SimplifyResult result = collapse_loops(surface, 21.0).simplified;
  // Of the 12 quads seven are on it: two at the rim, the crossing, four around the square in the middle. The others
  // are too wide.
  EXPECT_EQ(result.face_map[0], kMorphCollapsed);
  EXPECT_EQ(result.face_map[1], kMorphCollapsed);
  EXPECT_EQ(result.surface.triangles.size(), 10u);
  EXPECT_NEAR(total_area(result.surface), total_area(surface), 1e-3);
  for (const uint32_t v : {1u, 2u, 3u}) EXPECT_EQ(result.vertex_map[v], result.vertex_map[0]);
}

TEST(CollapseLoops, ALoopThatLiesBesideItselfAllAlongStays) {
  const Surface helix = make_helix(30, 6);  // its row is 0.25 wide: with any other loop gone it would still be there
  const Surface result = collapse_loops(helix, 2.0).simplified.surface;
  ASSERT_LT(result.triangles.size(), helix.triangles.size());
  Box3 before = helix.bounds(), after = result.bounds();
  EXPECT_NEAR(after.size().z, before.size().z, 0.3);
}

TEST(CollapseLoops, TwistedLoopsStay) {
  Surface strip;
  constexpr int kAround = 60, kAcross = 9;
  for (int i = 0; i < kAround; ++i) {
    const float u = 2 * kPi * static_cast<float>(i) / kAround;
    for (int j = 0; j <= kAcross; ++j) {
      const float w = 0.6f * (static_cast<float>(j) / kAcross - 0.5f);
      strip.positions.emplace_back((1 + w * std::cos(u / 2)) * std::cos(u), (1 + w * std::cos(u / 2)) * std::sin(u),
                                   w * std::sin(u / 2));
    }
  }
  const auto vertex = [&](int i, int j) {
    return static_cast<uint32_t>(i < kAround ? i * (kAcross + 1) + j : kAcross - j);
  };
  for (int i = 0; i < kAround; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      strip.triangles.emplace_back(vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1));
      strip.triangles.emplace_back(vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1));
    }
  }
  add_materials(strip);
  pair_into_quads(strip);
  const Topology before = topology_of(strip);
  const SimplifyResult result = collapse_loops(strip, 0.4).simplified;
  expect_valid(strip, result);
  expect_quads_whole(result.surface);
  EXPECT_LT(result.surface.triangles.size(), strip.triangles.size() / 2);
  const Topology after = topology_of(result.surface);
  EXPECT_EQ(after.euler, before.euler);
  EXPECT_EQ(after.borders, 1u);
  EXPECT_EQ(after.nonmanifold_edges + after.nonmanifold_vertices, 0u);
}

TEST(CollapseLoops, TheTotalMaterialOfAPlaneStaysExactly) {
  Surface plane = with_quads(make_plane(40, 40, 1.0f, 1.0f));
  randomize_materials(plane);
  const Surface result = collapse_loops(plane, 0.2).simplified.surface;
  ASSERT_LT(result.triangles.size(), plane.triangles.size() / 4);
  const FaceMaterial before = total_material(plane), after = total_material(result);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(after.diffuse[c], before.diffuse[c], 1e-4f);
  EXPECT_NEAR(after.roughness2, before.roughness2, 1e-4f);
  EXPECT_NEAR(after.sggx.trace(), before.sggx.trace(), 1e-4f);
  EXPECT_NEAR(after.sggx.xy, before.sggx.xy, 1e-4f);
}

TEST(CollapseLoops, MaterialsDoNotSpreadAlongALoop) {
  // Black on the left, white on the right; loops run from left to right through both.
  Surface plane = with_quads(make_plane(40, 40, 1.0f, 1.0f));
  const auto middle = [](const Surface& surface, size_t f) {
    const uvec3& t = surface.triangles[f];
    return (surface.positions[t.x] + surface.positions[t.y] + surface.positions[t.z]) / 3.0f;
  };
  for (size_t f = 0; f < plane.triangles.size(); ++f) plane.materials[f].diffuse = vec3(middle(plane, f).x > 0.5f);
  const Surface result = collapse_loops(plane, 0.2).simplified.surface;
  ASSERT_LT(result.triangles.size(), plane.triangles.size() / 4);
  for (size_t f = 0; f < result.triangles.size(); ++f) {
    const float x = middle(result, f).x;
    if (std::abs(x - 0.5f) > 0.2f) {
      EXPECT_NEAR(result.materials[f].diffuse.x, x > 0.5f ? 1.0f : 0.0f, 1e-5f) << x;
    }
  }
}

TEST(CollapseLoops, WithoutQuadsNothingCollapses) {
  const Surface sphere = make_sphere(40, 20, 1.0f);
  EXPECT_EQ(collapse_loops(sphere, 1.0).simplified.surface.triangles, sphere.triangles);
}

TEST(CollapseLoops, TheSameForAnyNumberOfThreads) {
  Surface many;
  for (const Surface& surface : {make_crossing(), make_helix(30, 6), make_rounded_cube(8, 0.3f)}) {
    for (int i = 0; i < 20; ++i) many = join(std::move(many), surface);
  }
  pair_into_quads(many);
  const Surface parallel = collapse_loops(many, 0.9).simplified.surface;
  const ThreadLimit one(1);
  const Surface serial = collapse_loops(many, 0.9).simplified.surface;
  ASSERT_LT(serial.triangles.size(), many.triangles.size());
  EXPECT_EQ(serial.triangles, parallel.triangles);
  EXPECT_EQ(serial.quad, parallel.quad);
  ASSERT_EQ(serial.positions.size(), parallel.positions.size());
  EXPECT_EQ(std::memcmp(serial.positions.data(), parallel.positions.data(), serial.positions.size() * sizeof(vec3)), 0);
  EXPECT_EQ(
      std::memcmp(serial.materials.data(), parallel.materials.data(), serial.materials.size() * sizeof(FaceMaterial)),
      0);
}

// ---- which method simplify() takes

TEST(SimplifyMethods, LoopsCollapseEdgesWhereThereAreNoQuads) {
  Surface plane = with_quads(make_plane(40, 40, 1.0f, 1.0f));
  const size_t half = plane.triangles.size() / 2;  // the lower rows are quads
  std::fill(plane.quad.begin() + static_cast<std::ptrdiff_t>(half), plane.quad.end(), kNoIndex);
  const SimplifyResult result = simplify(plane, {0.2f, SimplifyMethod::Loops});
  expect_valid(plane, result);
  expect_quads_whole(result.surface);
  const auto is_gone = [](uint32_t face) { return face == kMorphCollapsed; };
  const auto middle = result.face_map.begin() + static_cast<std::ptrdiff_t>(half);
  EXPECT_GT(std::count_if(result.face_map.begin(), middle, is_gone), 400);
  EXPECT_GT(std::count_if(middle, result.face_map.end(), is_gone), 400);
  EXPECT_EQ(topology_of(result.surface).euler, 1);
  EXPECT_EQ(topology_of(result.surface).nonmanifold_edges, 0u);
  EXPECT_NEAR(total_area(result.surface), 1.0, 1e-5);
}

TEST(SimplifyMethods, AutoTakesLoopsOfWellStructuredPartsAndEdgesOfOthers) {
  // The torus is a mesh of quads; of the sphere only a third is.
  const Surface torus = make_torus(80, 30, 0.3f), sphere = make_sphere(60, 30, 1.0f);
  Surface both = with_quads(join(torus, sphere));
  const size_t first = torus.triangles.size();
  for (size_t f = first; f < both.quad.size(); ++f) {
    if (both.quad[f] % 3 != 0) both.quad[f] = kNoIndex;
  }
  const Surface result = simplify(both, {0.2f, SimplifyMethod::Auto}).surface;
  const Surface loops = simplify(with_quads(torus), {0.2f, SimplifyMethod::Loops}).surface;
  const Surface edges = simplify(sphere, {0.2f, SimplifyMethod::Edges}).surface;
  ASSERT_EQ(result.triangles.size(), loops.triangles.size() + edges.triangles.size());
  EXPECT_TRUE(std::equal(loops.triangles.begin(), loops.triangles.end(), result.triangles.begin()));
  EXPECT_TRUE(std::equal(edges.positions.begin(), edges.positions.end(),
                         result.positions.begin() + static_cast<std::ptrdiff_t>(loops.positions.size())));
}

TEST(SimplifyMethods, AutoIsEdgesWhereThereAreNoQuads) {
  const Surface sphere = make_sphere(60, 30, 1.0f);
  const Surface edges = simplify(sphere, {0.2f, SimplifyMethod::Edges}).surface;
  const Surface chosen = simplify(sphere, {0.2f, SimplifyMethod::Auto}).surface;
  EXPECT_EQ(edges.triangles, chosen.triangles);
  EXPECT_EQ(edges.positions, chosen.positions);
}

TEST(SimplifyMethods, AreKnownByTheirNames) {
  for (const auto method : {SimplifyMethod::Auto, SimplifyMethod::Loops, SimplifyMethod::Edges}) {
    EXPECT_EQ(parse_simplify_method(name_of(method)).value(), method);
  }
  EXPECT_NE(parse_simplify_method("quads").error().message.find("auto, loops, edges"), std::string::npos);
}

}  // namespace
}  // namespace farfield
