// SPDX-License-Identifier: Apache-2.0
#include "prefilter/simplify.h"

#include <gtest/gtest.h>

#include <atomic>

#include <algorithm>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "base/parallel.h"
#include "cache/level.h"
#include "prefilter/edge_table.h"
#include "prefilter/material_filter.h"
#include "prefilter/vertex_placement.h"
#include "tests/support/simplified_surface.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using namespace test;

double mean_edge(const Surface& surface, double* longest = nullptr) {
  const EdgeTable edges = build_edge_table(surface.triangles, surface.positions.size());
  double sum = 0;
  for (uint32_t e = 0; e < edges.size(); ++e) {
    const double length =
        glm::length(surface.positions[edges.smaller_vertex[e]] - surface.positions[edges.larger_vertex[e]]);
    sum += length;
    if (longest) *longest = std::max(*longest, length);
  }
  return sum / edges.size();
}

double distance_to(const Surface& surface, const dvec3& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const uvec3& t : surface.triangles) {
    const dvec3 a(surface.positions[t.x]), b(surface.positions[t.y]), c(surface.positions[t.z]);
    const dvec3 bary = closest_barycentric(p, a, b, c);
    nearest = std::min(nearest, glm::length(bary.x * a + bary.y * b + bary.z * c - p));
  }
  return nearest;
}

/// A leaf cut out of a grid of squares, as masks are: its outline is a staircase.
Surface make_jagged_leaf(int side) {
  Surface leaf = make_plane(side, side, 1.0f, 1.0f);
  std::erase_if(leaf.triangles, [&](const uvec3& t) {
    const vec3 low = glm::min(leaf.positions[t.x], glm::min(leaf.positions[t.y], leaf.positions[t.z]));
    const float half_width = 0.45f * std::sin(kPi * low.y) * (0.75f + 0.25f * std::cos(20.0f * low.y));
    return std::abs(low.x - 0.5f) > half_width;
  });
  add_materials(leaf);
  return leaf;
}

TEST(Simplify, TheTotalMaterialOfAPlaneStaysExactly) {  // eq. 8.3.7, over all collapses
  Surface plane = make_plane(40, 40, 1.0f, 1.0f);
  randomize_materials(plane);
  const SimplifyResult result = simplify(plane, {.resolution = 0.2f});
  ASSERT_LT(result.surface.triangles.size(), plane.triangles.size() / 4);
  const FaceMaterial before = total_material(plane), after = total_material(result.surface);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(after.diffuse[c], before.diffuse[c], 1e-4f);
  EXPECT_NEAR(after.specular.x, before.specular.x, 1e-4f);
  EXPECT_NEAR(after.transmission.x, before.transmission.x, 1e-4f);
  EXPECT_NEAR(after.roughness2, before.roughness2, 1e-4f);
  EXPECT_NEAR(after.sggx.trace(), before.sggx.trace(), 1e-4f);
  EXPECT_NEAR(after.sggx.xy, before.sggx.xy, 1e-4f);
}

TEST(Simplify, OneMaterialStaysOne) {
  Surface sphere = make_sphere(60, 30, 1.0f);
  for (FaceMaterial& material : sphere.materials) material = sphere.materials[0];
  for (const FaceMaterial& material : simplify(sphere, {.resolution = 0.3f}).surface.materials) {
    EXPECT_NEAR(material.diffuse.x, 0.5f, 1e-5f);
    EXPECT_NEAR(material.sggx.trace(), 1.0f, 1e-5f);
  }
}

TEST(Simplify, ManifoldsStayManifoldsOfTheSameTopology) {
  const std::vector<Surface> surfaces = {make_sphere(60, 30, 1.0f), make_torus(80, 30, 0.3f),
                                         make_tube(40, 40, 0.5f, 2.0f), make_plane(50, 50, 1.0f, 1.0f),
                                         make_jagged_leaf(64)};
  for (const Surface& surface : surfaces) {
    const Topology before = topology_of(surface);
    for (const float resolution : {0.1f, 0.3f, 1.0f, 100.0f}) {
      const SimplifyResult result = simplify(surface, {.resolution = resolution});
      expect_valid(surface, result);
      const Topology after = topology_of(result.surface);
      if (before.nonmanifold_vertices == 0) {
        EXPECT_EQ(after.euler, before.euler);
        EXPECT_EQ(after.borders, before.borders);
      }
      EXPECT_EQ(after.nonmanifold_edges, 0u);
      EXPECT_LE(after.nonmanifold_vertices, before.nonmanifold_vertices);
    }
  }
}

TEST(Simplify, EdgesBecomeAboutHalfTheResolution) {
  for (const float resolution : {0.1f, 0.2f, 0.4f}) {
    for (const Surface& surface : {make_sphere(160, 80, 1.0f), make_plane(120, 120, 2.0f, 2.0f)}) {
      double longest = 0;
      const double mean = mean_edge(simplify(surface, {.resolution = resolution}).surface, &longest);
      EXPECT_GT(mean, 0.4 * resolution);
      EXPECT_LT(mean, 0.65 * resolution);
      EXPECT_LE(longest, resolution);
    }
  }
}

TEST(Simplify, PlanesStayPlaneAndKeepTheirArea) {
  const Surface plane = make_plane(60, 60, 1.0f, 1.0f);
  const SimplifyResult result = simplify(plane, {.resolution = 0.2f});
  EXPECT_LT(result.surface.triangles.size(), plane.triangles.size() / 8);
  EXPECT_NEAR(total_area(result.surface), 1.0, 1e-5);
  for (const vec3& p : result.surface.positions) EXPECT_NEAR(p.z, 0.0f, 1e-6f);
}

TEST(Simplify, ALeafCutFromAMaskKeepsItsArea) {
  const Surface leaf = make_jagged_leaf(64);
  const double area = total_area(leaf);
  for (const float resolution : {0.05f, 0.1f, 0.2f}) {
    const SimplifyResult result = simplify(leaf, {.resolution = resolution});
    EXPECT_NEAR(total_area(result.surface), area, 0.005 * area) << resolution;
    EXPECT_LT(result.surface.triangles.size(), leaf.triangles.size() / 2);
  }
}

TEST(Simplify, CurvedSurfacesKeepTheirArea) {
  const std::vector<Surface> surfaces = {make_sphere(160, 80, 1.0f), make_torus(160, 60, 0.4f),
                                         make_tube(80, 80, 0.5f, 2.0f)};
  for (const Surface& surface : surfaces) {
    const double area = total_area(surface);
    EXPECT_NEAR(total_area(simplify(surface, {.resolution = 0.1f}).surface), area, 0.002 * area);
    EXPECT_NEAR(total_area(simplify(surface, {.resolution = 0.4f}).surface), area, 0.02 * area);
  }
}

TEST(Simplify, BothSurfacesStayWithinAQuarterOfTheResolutionOfEachOther) {
  const Surface torus = make_torus(60, 24, 0.4f);
  for (const float resolution : {0.2f, 0.5f}) {
    const SimplifyResult result = simplify(torus, {.resolution = resolution});
    for (const vec3& p : torus.positions) EXPECT_LT(distance_to(result.surface, dvec3(p)), 0.25 * resolution);
    for (const uvec3& t : result.surface.triangles) {
      const dvec3 a(result.surface.positions[t.x]), b(result.surface.positions[t.y]), c(result.surface.positions[t.z]);
      EXPECT_LT(distance_to(torus, (a + b + c) / 3.0), 0.25 * resolution);
    }
  }
}

TEST(Simplify, WindingDoesNotMatter) {
  const Surface sphere = make_sphere(40, 20, 1.0f);
  Surface shuffled = sphere;
  std::mt19937 rng(5);
  for (uvec3& t : shuffled.triangles) {
    if (rng() % 2) std::swap(t.y, t.z);
  }
  const SimplifyResult a = simplify(sphere, {.resolution = 0.4f}), b = simplify(shuffled, {.resolution = 0.4f});
  EXPECT_EQ(a.vertex_map, b.vertex_map);
  ASSERT_EQ(a.surface.positions.size(), b.surface.positions.size());
  for (size_t v = 0; v < a.surface.positions.size(); ++v) {
    EXPECT_LT(glm::length(a.surface.positions[v] - b.surface.positions[v]), 1e-5f);
  }
}

TEST(Simplify, BordersAndNonManifoldEdgesCollapseAlongThemselves) {
  // A plane with a fin on its middle row: three faces at each edge of the fin's foot.
  Surface surface = make_plane(40, 40, 1.0f, 1.0f);
  const uint32_t first = static_cast<uint32_t>(surface.positions.size()), row = 20 * 41;
  for (uint32_t i = 0; i <= 40; ++i) surface.positions.push_back(surface.positions[row + i] + vec3(0, 0, 0.1f));
  for (uint32_t i = 0; i < 40; ++i) {
    surface.triangles.emplace_back(row + i, row + i + 1, first + i + 1);
    surface.triangles.emplace_back(row + i, first + i + 1, first + i);
  }
  add_materials(surface);
  const SimplifyResult result = simplify(surface, {.resolution = 0.2f});
  expect_valid(surface, result);
  EXPECT_NEAR(total_area(result.surface), 1.1, 0.003);
  EXPECT_GT(topology_of(result.surface).nonmanifold_edges, 0u);
  EXPECT_LT(topology_of(result.surface).nonmanifold_edges, 20u);
  EXPECT_LT(result.surface.triangles.size(), surface.triangles.size() / 4);
}

TEST(Simplify, OneSidedAndTouchingSurfacesAreNoProblem) {
  const Surface moebius = make_grid(120, 10, false, [](float u, float v) {
    const float phi = 2 * kPi * u, w = v - 0.5f;
    const float radius = 1.0f + w * std::cos(0.5f * phi);
    return vec3(radius * std::cos(phi), radius * std::sin(phi), w * std::sin(0.5f * phi));
  });
  // Weld the ends, turned over.
  Surface closed = moebius;
  for (uvec3& t : closed.triangles) {
    for (int c = 0; c < 3; ++c) {
      if (t[c] % 121 == 120) t[c] = (10 - t[c] / 121) * 121;
    }
  }
  add_materials(closed);
  const SimplifyResult result = simplify(closed, {.resolution = 0.4f});
  expect_valid(closed, result);
  EXPECT_EQ(topology_of(result.surface).borders, 1u);
  EXPECT_NEAR(total_area(result.surface), total_area(closed), 0.02 * total_area(closed));

  // Two tubes that share one vertex.
  Surface bow_tie = join(make_tube(20, 20, 0.5f, 1.0f), make_tube(20, 20, 0.5f, 1.0f));
  for (uvec3& t : bow_tie.triangles) {
    for (int c = 0; c < 3; ++c) {
      if (t[c] == 420) t[c] = 0;
    }
  }
  expect_valid(bow_tie, simplify(bow_tie, {.resolution = 0.5f}));
}

TEST(Simplify, TheResultDoesNotDependOnTheNumberOfThreads) {
  Surface many;
  for (int i = 0; i < 60; ++i) {
    Surface part = i % 2 ? make_sphere(16, 8, 1.0f) : make_plane(8, 8, 1.0f, 1.0f);
    for (vec3& p : part.positions) p += vec3(3.0f * static_cast<float>(i), 0, 0);
    many = join(std::move(many), part);
  }
  const SimplifyResult expected = simplify(many, {.resolution = 0.8f});
  const ThreadLimit one(1);
  const SimplifyResult result = simplify(many, {.resolution = 0.8f});
  EXPECT_EQ(result.vertex_map, expected.vertex_map);
  EXPECT_EQ(result.face_map, expected.face_map);
  ASSERT_EQ(result.surface.materials.size(), expected.surface.materials.size());
  EXPECT_EQ(std::memcmp(result.surface.positions.data(), expected.surface.positions.data(),
                        sizeof(vec3) * expected.surface.positions.size()),
            0);
  EXPECT_EQ(std::memcmp(result.surface.materials.data(), expected.surface.materials.data(),
                        sizeof(FaceMaterial) * expected.surface.materials.size()),
            0);
}

TEST(Simplify, PartsDoNotInfluenceEachOther) {
  const Surface sphere = make_sphere(24, 12, 1.0f);
  const SimplifyResult alone = simplify(sphere, {.resolution = 0.6f});
  const SimplifyResult both = simplify(join(sphere, make_torus(40, 20, 0.3f)), {.resolution = 0.6f});
  ASSERT_GT(both.surface.positions.size(), alone.surface.positions.size());
  EXPECT_TRUE(
      std::equal(alone.surface.positions.begin(), alone.surface.positions.end(), both.surface.positions.begin()));
}

TEST(Simplify, ExtremesHaveDefinedResults) {
  EXPECT_TRUE(simplify(Surface{}, {.resolution = 1.0f}).surface.triangles.empty());
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  Surface plane = make_plane(4, 4, 1.0f, 1.0f);
  plane.positions.emplace_back(9.0f, 9.0f, 9.0f);  // that no face uses
  for (const float resolution : {0.0f, -1.0f, nan}) {
    EXPECT_EQ(simplify(plane, {.resolution = resolution}).surface.triangles.size(), plane.triangles.size());
  }
  const std::vector<Surface> surfaces = {
      plane,
      make_plane(1, 1, 1.0f, 1.0f),
      make_plane(8, 8, 0.0f, 0.0f),  // all in one point
      make_plane(8, 8, 1.0f, 0.0f),  // all in one line
      make_plane(8, 8, 1e18f, 1e18f),
      make_plane(8, 8, 1e-18f, 1e-18f),
      make_sphere(3, 2, 1.0f),
      join(plane, plane),
      make_grid(12, 12, false, [](float u, float v) { return vec3(1e7f + u, v, 1e7f); }),  // vertices fall together
  };
  for (const Surface& surface : surfaces) {
    for (const float resolution : {1e-20f, 0.3f, 1.0f, 5.0f, 1e19f, infinity}) {
      const SimplifyResult result = simplify(surface, {.resolution = resolution});
      expect_valid(surface, result);
      EXPECT_FALSE(result.surface.triangles.empty());  // parts never vanish
    }
  }
}

TEST(Simplify, RandomSoupsAreNoProblem) {
  std::mt19937 rng(23);
  const auto random = [&](uint32_t below) { return static_cast<uint32_t>(rng() % below); };
  std::uniform_real_distribution<float> u;
  for (int round = 0; round < 60; ++round) {
    Surface soup;
    const uint32_t vertices = 4 + random(40);
    for (uint32_t v = 0; v < vertices; ++v) soup.positions.emplace_back(u(rng), u(rng), round % 3 ? u(rng) : 0.0f);
    while (soup.triangles.size() < 2 * vertices) {
      const uvec3 t(random(vertices), random(vertices), random(vertices));
      if (t.x != t.y && t.y != t.z && t.z != t.x) soup.triangles.push_back(t);
    }
    add_materials(soup);
    expect_valid(soup, simplify(soup, {.resolution = 2.0f * u(rng)}));
  }
}

TEST(Simplify, EndsOnceCancelled) {
  const std::atomic<bool> cancel{true};
  const Surface sphere = test::make_sphere(32, 16, 1.0f);
  ASSERT_LT(simplify(sphere, {.resolution = 1.0f}).surface.triangles.size(), sphere.triangles.size());
  EXPECT_EQ(simplify(sphere, {.resolution = 1.0f}, {{}, &cancel}).surface.triangles.size(), sphere.triangles.size());
}

}  // namespace
}  // namespace farfield
