// SPDX-License-Identifier: Apache-2.0
// Limit surfaces against closed forms, and what a tessellation owes its users: no cracks, a bounded error, one answer.
#include "prefilter/subdivide.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "base/parallel.h"
#include "evaluate/triangle_distance.h"
#include "tests/support/cages.h"
#include "tests/support/watertight.h"

namespace farfield {
namespace {

using namespace test;

SubdivisionOptions catmull_clark(double error = 0.25, uint32_t grid = 64) {
  SubdivisionOptions options;
  options.scheme = SubdivisionScheme::CatmullClark;
  options.error = error;
  options.grid = grid;
  return options;
}

SubdivisionOptions loop() {
  SubdivisionOptions options = catmull_clark();
  options.scheme = SubdivisionScheme::Loop;
  return options;
}

SourceMesh refined(const SourceMesh& cage, const SubdivisionOptions& options) {
  auto mesh = subdivide(cage, options, "cage");
  EXPECT_TRUE(mesh) << mesh.error().message;
  return mesh ? std::move(*mesh) : SourceMesh{};
}

double distance_to_nearest(const SourceMesh& mesh, const dvec3& point) {
  double least = INFINITY;
  for (const uint32_t v : mesh.corner_position) least = std::min(least, glm::length(mesh.positions[v] - point));
  return least;
}

/// Each edge has one face on either side, and all faces wind alike.
void expect_watertight(const SourceMesh& mesh) {
  ASSERT_GT(mesh.face_count(), 0u);
  EXPECT_EQ(open_edges(mesh), 0u);
}

/// Vertices - edges + faces.
long euler_characteristic(const SourceMesh& mesh) {
  std::set<uint32_t> vertices(mesh.corner_position.begin(), mesh.corner_position.end());
  std::set<std::pair<uint32_t, uint32_t>> edges;
  for_each_edge(mesh, [&](uint32_t a, uint32_t b) { edges.insert(std::minmax(a, b)); });
  return static_cast<long>(vertices.size()) - static_cast<long>(edges.size()) + static_cast<long>(mesh.face_count());
}

dvec3 corner(const SourceMesh& mesh, size_t number) { return mesh.positions[mesh.corner_position[number]]; }

/// Of the fan of triangles from a face's first corner: twice the area times the normal.
dvec3 area_vector(const SourceMesh& mesh, size_t face) {
  dvec3 sum(0.0);
  const uint32_t begin = mesh.face_begin[face], end = mesh.face_begin[face + 1];
  for (uint32_t i = begin + 1; i + 1 < end; ++i) {
    sum += glm::cross(corner(mesh, i) - corner(mesh, begin), corner(mesh, i + 1) - corner(mesh, begin));
  }
  return sum;
}

double area(const SourceMesh& mesh) {
  double sum = 0;
  for (size_t face = 0; face < mesh.face_count(); ++face) sum += 0.5 * glm::length(area_vector(mesh, face));
  return sum;
}

/// The farthest that vertices of `fine`, every seventh of them, lie from the faces of `coarse`.
double farthest(const SourceMesh& fine, const SourceMesh& coarse) {
  double most = 0;
  for (size_t v = 0; v < fine.positions.size(); v += 7) {
    const dvec3& p = fine.positions[v];
    double least = INFINITY;
    for (size_t face = 0; face < coarse.face_count(); ++face) {
      const uint32_t begin = coarse.face_begin[face], end = coarse.face_begin[face + 1];
      for (uint32_t i = begin + 1; i + 1 < end; ++i) {
        least =
            std::min(least, distance_to_triangle(p, corner(coarse, begin), corner(coarse, i), corner(coarse, i + 1)));
      }
    }
    most = std::max(most, least);
  }
  return most;
}

bool has_warning(const SourceMesh& mesh, const std::string& text) {
  return std::ranges::any_of(mesh.warnings, [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

// ---- limits known in closed form

TEST(Subdivide, CubeTendsToItsKnownLimits) {
  SubdivisionOptions options = catmull_clark();
  options.edge = 2;  // voxels; rates are then even, and the middles of faces and edges are vertices
  const SourceMesh mesh = refined(cube_cage(), options);
  // [Halstead et al. 1993]: (n^2 v + 4 sum of edges + sum of diagonals) / (n (n + 5)), at the cage and once refined.
  EXPECT_LT(distance_to_nearest(mesh, dvec3(0.5)), 1e-12);
  EXPECT_LT(distance_to_nearest(mesh, {0, 0, 68.0 / 81}), 1e-12);
  const double edge = (12 + 4 * 19.0 / 9 + 1.5) / 36;
  EXPECT_LT(distance_to_nearest(mesh, {0, edge, edge}), 1e-12);
}

TEST(Subdivide, TrianglesTendToTheirKnownLimitsByCatmullAndClark) {
  const std::vector<dvec3> p = tetrahedron_cage().positions;
  const SourceMesh mesh = refined(tetrahedron_cage(), catmull_clark());
  for (size_t v = 0; v < 4; ++v) {
    dvec3 faces(0.0), edges(0.0), middles(0.0);  // sums around the point, once refined
    for (size_t i = 0; i < 4; ++i) {
      if (i == v) continue;
      faces += -p[i] / 3.0;  // the middle of the face without point i
      middles += (p[v] + p[i]) / 2.0;
      dvec3 others(0.0);  // of the two faces at the edge v i
      for (size_t k = 0; k < 4; ++k) others += k == v || k == i ? dvec3(0.0) : -p[k] / 3.0;
      edges += (p[v] + p[i] + others) / 4.0;
    }
    const dvec3 point = (faces / 3.0 + 2.0 * middles / 3.0) / 3.0;
    EXPECT_LT(distance_to_nearest(mesh, (9.0 * point + 4.0 * edges + faces) / 24.0), 1e-12);
  }
  expect_watertight(mesh);
}

TEST(Subdivide, NormalsAreThoseOfTheLimit) {
  SubdivisionOptions options = catmull_clark(0.01);
  options.edge = 2;
  const SourceMesh mesh = refined(cube_cage(), options);
  ASSERT_EQ(mesh.corner_normal.size(), mesh.corner_count());
  for (size_t i = 0; i < mesh.corner_count(); ++i) {
    const vec3& n = mesh.corner_normal[i];
    EXPECT_NEAR(glm::length(n), 1, 1e-6);
    const bool is_corner = glm::length(corner(mesh, i) - dvec3(0.5)) < 1e-9;
    const bool is_middle = glm::length(corner(mesh, i) - dvec3(0, 0, 68.0 / 81)) < 1e-9;
    EXPECT_TRUE(!is_corner || glm::dot(n, vec3(std::sqrt(1 / 3.0f))) > 0.9999999f);
    EXPECT_TRUE(!is_middle || n.z > 0.9999999f);
  }
  // Finite differences: facets of 1 / 32 of the surface's radius turn by less than 2 degrees.
  for (size_t face = 0; face < mesh.face_count(); ++face) {
    const vec3 n(glm::normalize(area_vector(mesh, face)));
    for (uint32_t i = mesh.face_begin[face]; i < mesh.face_begin[face + 1]; ++i) {
      EXPECT_GT(glm::dot(n, mesh.corner_normal[i]), std::cos(2.0 * 3.14159 / 180)) << face;
    }
  }
}

TEST(Subdivide, RegularGridIsTheBicubicBSpline) {
  const auto basis = [](double t) {
    return std::array{(1 - t) * (1 - t) * (1 - t) / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                      (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6, t * t * t / 6};
  };
  SourceMesh cage = grid_cage(5);
  std::mt19937 rng(3);
  for (dvec3& p : cage.positions) p.z = std::uniform_real_distribution<double>(0, 2)(rng);
  SubdivisionOptions options = catmull_clark(0.05);
  options.uv = CageUv::All;  // then the corners' uv are the parameters
  const SourceMesh mesh = refined(cage, options);
  size_t compared = 0;
  for (size_t face = 0; face < mesh.face_count(); ++face) {
    const uint32_t of_cage = mesh.face_number[face];
    if (of_cage % 5 == 0 || of_cage % 5 == 4 || of_cage / 5 == 0 || of_cage / 5 == 4) continue;  // the rim is no spline
    for (uint32_t i = mesh.face_begin[face]; i < mesh.face_begin[face + 1]; ++i, ++compared) {
      const glm::dvec2 uv = 5.0 * glm::dvec2(mesh.corner_uv[i]);
      const int x = static_cast<int>(of_cage % 5), y = static_cast<int>(of_cage / 5);
      const auto u = basis(uv.x - x), v = basis(uv.y - y);
      dvec3 wanted(0.0);
      for (int j = 0; j < 4; ++j) {
        for (int k = 0; k < 4; ++k) {
          wanted += u[static_cast<size_t>(k)] * v[static_cast<size_t>(j)] *
                    cage.positions[static_cast<size_t>((y + j - 1) * 6 + x + k - 1)];
        }
      }
      EXPECT_LT(glm::length(corner(mesh, i) - wanted), 1e-5) << uv.x << " " << uv.y;
    }
  }
  EXPECT_GT(compared, 1000u);
}

TEST(Subdivide, LoopTendsToItsKnownLimits) {
  // [Loop 1987]: (1 - n chi) v + chi * sum of neighbours; chi = 1 / 5 at a tetrahedron's points.
  const SourceMesh tetrahedron = refined(tetrahedron_cage(), loop());
  for (const dvec3& p : tetrahedron_cage().positions) EXPECT_LT(distance_to_nearest(tetrahedron, p / 5.0), 1e-12);
  const SourceMesh icosahedron = icosahedron_cage();
  const SourceMesh mesh = refined(icosahedron, loop());
  const double c = 3 / 8.0 + std::cos(2 * 3.141592653589793 / 5) / 4;
  const double beta = (5 / 8.0 - c * c) / 5, chi = 1 / (5 + 3 / (8 * beta));
  for (const dvec3& p : icosahedron.positions) {
    dvec3 sum(0.0);
    for (const dvec3& q : icosahedron.positions) {
      if (q != p && glm::length(q - p) < 1.2 * glm::length(p)) sum += q;
    }
    EXPECT_LT(distance_to_nearest(mesh, (1 - 5 * chi) * p + chi * sum), 1e-12);
  }
  expect_watertight(mesh);
}

// ---- creases, corners, boundaries, holes

TEST(Subdivide, CubeWithSharpEdgesIsTheCube) {
  for (const float sharpness : {10.0f, 1e30f, std::numeric_limits<float>::infinity()}) {
    const SourceMesh mesh = refined(creased_cube_cage(sharpness), catmull_clark());
    EXPECT_EQ(mesh.face_count(), 6u);
    EXPECT_NEAR(area(mesh), 24, 1e-12);
    expect_watertight(mesh);
    for (size_t face = 0; face < 6; ++face) {  // what shades is as sharp
      const vec3 n(glm::normalize(area_vector(mesh, face)));
      for (size_t i = 4 * face; i < 4 * face + 4; ++i) EXPECT_GT(glm::dot(n, mesh.corner_normal[i]), 0.99999f);
    }
  }
}

TEST(Subdivide, SharperCreasesComeNearerToTheirEdges) {
  double last = area(refined(cube_cage(), catmull_clark(0.05)));
  for (const float sharpness : {0.5f, 1.0f, 1.5f, 2.0f, 3.0f, 5.0f}) {
    const SourceMesh mesh = refined(creased_cube_cage(sharpness), catmull_clark(0.05));
    const double now = area(mesh);
    EXPECT_GT(now, last) << sharpness;
    EXPECT_LT(now, 24) << sharpness;
    expect_watertight(mesh);
    last = now;
  }
  EXPECT_GT(last, 22);
}

TEST(Subdivide, SharpnessZeroIsSmooth) {
  EXPECT_EQ(refined(creased_cube_cage(0), catmull_clark()).positions, refined(cube_cage(), catmull_clark()).positions);
}

TEST(Subdivide, SharpCornerStaysWhereItIs) {
  SourceMesh cage = cube_cage();
  cage.cage.sharp_vertices = {0};
  cage.cage.vertex_sharpness = {INFINITY};
  const SourceMesh mesh = refined(cage, catmull_clark());
  EXPECT_LT(distance_to_nearest(mesh, cage.positions[0]), 1e-12);
  EXPECT_GT(distance_to_nearest(mesh, cage.positions[6]), 0.5);
  for (const vec3& n : mesh.corner_normal) EXPECT_NEAR(glm::length(n), 1, 1e-6);  // also at the tip
}

TEST(Subdivide, RimOfAPlaneFollowsTheRule) {
  SubdivisionOptions options = catmull_clark(0.01);
  options.boundary = CageBoundary::EdgeAndCorner;
  const SourceMesh kept = refined(grid_cage(1), options);
  EXPECT_EQ(kept.face_count(), 1u);
  for (const dvec3& p : grid_cage(1).positions) EXPECT_EQ(distance_to_nearest(kept, p), 0);
  options.boundary = CageBoundary::EdgeOnly;
  const SourceMesh rounded = refined(grid_cage(1), options);
  // The closed cubic B-spline of four points: (a + 4 b + c) / 6 at b.
  EXPECT_LT(distance_to_nearest(rounded, {1 / 6.0, 1 / 6.0, 0}), 1e-12);
  EXPECT_GT(distance_to_nearest(rounded, {0, 0, 0}), 0.2);
  SourceMesh tagged = grid_cage(1);
  tagged.cage.boundary = CageBoundary::EdgeOnly;
  options.boundary.reset();
  EXPECT_EQ(refined(tagged, options).positions, rounded.positions) << "the file's own rule";
}

TEST(Subdivide, HolesShapeTheirNeighboursAndAreNotThere) {
  SourceMesh cage = cube_cage();
  cage.cage.holes = {0};
  const SourceMesh mesh = refined(cage, catmull_clark());
  EXPECT_EQ(std::ranges::count(mesh.face_number, 0u), 0);
  EXPECT_LT(distance_to_nearest(mesh, dvec3(0.5)), 1e-12);
  EXPECT_LT(area(mesh), area(refined(cube_cage(), catmull_clark())));
}

// ---- texture coordinates

TEST(Subdivide, UvAtSeamsFollowTheRule) {
  SourceMesh cage = cube_cage();
  for (int face = 0; face < 6; ++face) {
    for (const vec2& uv : {vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 1)}) cage.corner_uv.push_back(uv);
  }
  for (const CageUv rule : {CageUv::All, CageUv::Boundaries, CageUv::CornersPlus1}) {
    SubdivisionOptions options = catmull_clark();
    options.uv = rule;
    const SourceMesh mesh = refined(cage, options);
    vec2 lower(2), upper(-2);
    for (const vec2& uv : mesh.corner_uv) lower = glm::min(lower, uv), upper = glm::max(upper, uv);
    EXPECT_EQ(lower, vec2(0)) << name_of(rule);  // each face is an island: its corners stay
    EXPECT_EQ(upper, vec2(1)) << name_of(rule);
  }
}

TEST(Subdivide, UvAlongASeamAreLinearOrACubicByTheRule) {
  SourceMesh cage = grid_cage(4);
  for (size_t i = 0; i < cage.corner_count(); ++i) {
    vec2& uv = cage.corner_uv[i];
    uv = vec2(uv.x + (i / 4 % 4 < 2 ? 0.0f : 10.0f), uv.y * uv.y);  // the right half is another island
  }
  const auto v_in_the_middle = [&](CageUv rule) {
    SubdivisionOptions options = catmull_clark();
    options.uv = rule;
    options.edge = 4;
    const SourceMesh mesh = refined(cage, options);
    std::set<float> found;
    for (size_t i = 0; i < mesh.corner_count(); ++i) {
      if (glm::length(corner(mesh, i) - dvec3(0.5, 0.5, 0)) < 1e-9) found.insert(mesh.corner_uv[i].y);
    }
    EXPECT_LT(*found.rbegin() - *found.begin(), 1e-6f) << "both islands agree";
    return *found.begin();
  };
  EXPECT_NEAR(v_in_the_middle(CageUv::Boundaries), 0.25, 1e-6);
  EXPECT_NEAR(v_in_the_middle(CageUv::All), 0.25, 1e-6);
  const double spline = (1 / 16.0 + 4 * 4 / 16.0 + 9 / 16.0) / 6;
  EXPECT_NEAR(v_in_the_middle(CageUv::CornersPlus1), spline, 1e-6);
  EXPECT_NEAR(v_in_the_middle(CageUv::None), spline, 1e-6);
}

TEST(Subdivide, UvWithoutSeamMoveWithTheSurface) {
  // Two columns of different width: linear uv would bend where they meet, smoothed ones do not.
  SourceMesh cage = grid_cage(4);
  for (dvec3& p : cage.positions) p.x *= p.x;
  for (size_t i = 0; i < cage.corner_count(); ++i) cage.corner_uv[i] = vec2(corner(cage, i));
  SubdivisionOptions options = catmull_clark();
  options.edge = 4;
  const SourceMesh mesh = refined(cage, options);  // corners-plus1
  for (size_t i = 0; i < mesh.corner_count(); ++i) {
    EXPECT_LT(glm::length(mesh.corner_uv[i] - vec2(corner(mesh, i))), 1e-6f) << "uv of a plane that is its own map";
  }
}

TEST(Subdivide, FacesWithoutUvKeepTheirNeighboursWhole) {
  SourceMesh cage = grid_cage(3);
  cage.corner_uv[16] = vec2(std::numeric_limits<float>::quiet_NaN());  // of the face in the middle
  const SourceMesh mesh = refined(cage, catmull_clark());
  for (size_t face = 0; face < mesh.face_count(); ++face) {
    for (uint32_t i = mesh.face_begin[face]; i < mesh.face_begin[face + 1]; ++i) {
      EXPECT_TRUE(mesh.face_number[face] == 4 || !std::isnan(mesh.corner_uv[i].x)) << mesh.face_number[face];
    }
  }
}

TEST(Subdivide, ColoursAreSmoothedAndMaterialsKept) {
  SourceMesh cage = cube_cage();
  for (size_t i = 0; i < cage.corner_count(); ++i)
    cage.corner_color.push_back(vec4(cage.corner_position[i] < 4, 0, 0, 1));
  cage.materials.resize(2);
  cage.face_material[5] = 1;
  const SourceMesh mesh = refined(cage, catmull_clark());
  ASSERT_EQ(mesh.corner_color.size(), mesh.corner_count());
  EXPECT_TRUE(std::ranges::any_of(mesh.corner_color, [](const vec4& c) { return c.x > 0.4f && c.x < 0.6f; }));
  for (size_t face = 0; face < mesh.face_count(); ++face) {
    EXPECT_EQ(mesh.face_material[face], mesh.face_number[face] == 5 ? 1u : 0u);
  }
}

// ---- what a tessellation owes

TEST(Subdivide, WhatIsClosedStaysClosed) {
  for (const SourceMesh& cage : {cube_cage(), drum_cage(7, 3.0), drum_cage(32, 0.05), creased_cube_cage(2.3f)}) {
    for (const double error : {4.0, 0.3, 0.02}) {
      const SourceMesh mesh = refined(cage, catmull_clark(error));
      expect_watertight(mesh);
      EXPECT_EQ(euler_characteristic(mesh), 2);
    }
  }
}

TEST(Subdivide, EdgesOfUnequalFacesAreCutAlike) {
  SourceMesh cage = cube_cage();
  for (size_t v = 4; v < 8; ++v) cage.positions[v] *= 5.0;  // one large face, one small
  const SourceMesh mesh = refined(cage, catmull_clark(0.05));
  expect_watertight(mesh);
  EXPECT_EQ(euler_characteristic(mesh), 2);
  std::map<uint32_t, int> facets;
  for (const uint32_t face : mesh.face_number) ++facets[face];
  EXPECT_GT(facets[1], 1.5 * facets[0]) << "large faces have more";
}

TEST(Subdivide, FacesLieWithinTheErrorOfTheSurface) {
  for (const SourceMesh& cage : {cube_cage(), drum_cage(7, 3.0), saddle_cage()}) {
    const SourceMesh fine = refined(cage, catmull_clark(0.04));
    size_t last = std::numeric_limits<size_t>::max();
    for (const double error : {0.1, 0.3, 0.9}) {
      const SourceMesh coarse = refined(cage, catmull_clark(error));
      const double voxel = longest_side(cage) / 64;
      EXPECT_LT(farthest(fine, coarse), (error + 0.04) * voxel) << error;
      EXPECT_GT(farthest(fine, coarse), 0.1 * error * voxel) << error << ": no more faces than needed";
      EXPECT_LT(coarse.face_count(), last);
      last = coarse.face_count();
    }
  }
}

TEST(Subdivide, AreaConvergesWithTheError) {
  const double exact = area(refined(cube_cage(), catmull_clark(0.001)));
  const double coarse = std::abs(area(refined(cube_cage(), catmull_clark(0.4))) - exact);
  const double fine = std::abs(area(refined(cube_cage(), catmull_clark(0.025))) - exact);
  EXPECT_LT(fine, coarse / 8);
  EXPECT_LT(fine, 0.002 * exact);
}

TEST(Subdivide, EdgesAreNoLongerThanAsked) {
  SubdivisionOptions options = catmull_clark(1e6);
  options.edge = 3;
  const SourceMesh mesh = refined(drum_cage(7, 3.0), options);
  const double voxel = longest_side(drum_cage(7, 3.0)) / 64;
  for_each_edge(mesh, [&](uint32_t a, uint32_t b) {
    // Diagonals of a cell, in the strips between rates, are longer.
    EXPECT_LT(glm::length(mesh.positions[a] - mesh.positions[b]), 2 * options.edge * voxel);
  });
  expect_watertight(mesh);
}

TEST(Subdivide, ThreadsDoNotMatter) {
  const SourceMesh cage = drum_cage(23, 1.0);
  std::vector<SourceMesh> meshes;
  for (const int threads : {1, 4}) {
    const ThreadLimit limit(threads);
    meshes.push_back(refined(cage, catmull_clark(0.01)));
  }
  EXPECT_EQ(meshes[0].positions, meshes[1].positions);
  EXPECT_EQ(meshes[0].corner_position, meshes[1].corner_position);
  EXPECT_EQ(meshes[0].corner_normal, meshes[1].corner_normal);
  EXPECT_EQ(meshes[0].face_begin, meshes[1].face_begin);
}

TEST(Subdivide, TooManyFacesGrowTheErrorAndSaySo) {
  SubdivisionOptions options = catmull_clark(1e-4);
  options.most_faces = 3000;
  const SourceMesh mesh = refined(cube_cage(), options);
  EXPECT_LE(mesh.face_count(), 3000u);
  EXPECT_GT(mesh.face_count(), 500u);
  EXPECT_TRUE(has_warning(mesh, "more than 3000 faces"));
  options.most_faces = 5;
  const auto none = subdivide(cube_cage(), options, "cube.obj");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::Unsupported);
  EXPECT_NE(none.error().message.find("cube.obj: a cage of 6 faces"), std::string::npos);
}

// ---- what files get wrong

TEST(Subdivide, WithoutSchemeNothingChangesButTagsAreSaid) {
  const SourceMesh mesh = refined(creased_cube_cage(3), {});
  EXPECT_EQ(mesh.face_count(), 6u);
  EXPECT_EQ(mesh.positions, cube_cage().positions);
  EXPECT_TRUE(has_warning(mesh, "--subdivide"));
  EXPECT_TRUE(refined(cube_cage(), {}).warnings.empty());
}

TEST(Subdivide, BadFacesAreLeftOut) {
  SourceMesh cage = cube_cage();
  const auto add_face = [&](const std::vector<uint32_t>& points) {
    cage.corner_position.insert(cage.corner_position.end(), points.begin(), points.end());
    cage.face_begin.push_back(static_cast<uint32_t>(cage.corner_count()));
    cage.face_material.push_back(0);
  };
  cage.positions.push_back(dvec3(std::numeric_limits<double>::quiet_NaN()));
  cage.positions.push_back(dvec3(100));  // of no face
  add_face({0, 1, 8});
  add_face({0, 0, 1, 1});
  add_face({0, 1, 2, 1, 3});
  add_face({});
  add_face({3, 2, 1, 0});  // the first again
  const SourceMesh mesh = refined(cage, catmull_clark());
  EXPECT_EQ(mesh.positions, refined(cube_cage(), catmull_clark()).positions);
  EXPECT_TRUE(has_warning(mesh, "1 faces of the cage have coordinates that are not finite"));
  EXPECT_TRUE(has_warning(mesh, "3 faces of the cage have fewer than three points, or one twice"));
  EXPECT_TRUE(has_warning(mesh, "1 faces of the cage repeat an earlier one"));
}

TEST(Subdivide, NothingLeftIsAnError) {
  SourceMesh cage = cube_cage();
  for (dvec3& p : cage.positions) p.x = INFINITY;
  const auto mesh = subdivide(cage, catmull_clark(), "cube.obj");
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::BadFile);
  EXPECT_EQ(mesh.error().warnings.size(), 1u);
}

TEST(Subdivide, WindingDoesNotMatter) {
  SourceMesh cage = cube_cage();
  for (const size_t face : {1, 4}) std::reverse(&cage.corner_position[4 * face], &cage.corner_position[4 * face] + 4);
  const SourceMesh mesh = refined(cage, catmull_clark());
  EXPECT_TRUE(has_warning(mesh, "2 faces of the cage wind against their neighbours"));
  expect_watertight(mesh);
  EXPECT_NEAR(area(mesh), area(refined(cube_cage(), catmull_clark())), 1e-9);
}

TEST(Subdivide, EdgesOfManyFacesAreSharp) {
  SourceMesh cage = grid_cage(2);  // with a wall on the line in the middle
  cage.positions.insert(cage.positions.end(), {{0.5, 0, 1}, {0.5, 0.5, 1}, {0.5, 1, 1}});
  for (const uint32_t c : {1u, 4u, 10u, 9u, 4u, 7u, 11u, 10u}) {
    cage.corner_position.push_back(c);
    cage.corner_uv.push_back(vec2(0));
  }
  cage.face_begin.insert(cage.face_begin.end(), {20, 24});
  cage.face_material.insert(cage.face_material.end(), {0, 0});
  const SourceMesh mesh = refined(cage, catmull_clark());
  EXPECT_TRUE(has_warning(mesh, "2 edges of the cage have more than two faces"));
  EXPECT_LT(distance_to_nearest(mesh, {0.5, 0.5, 0}), 1e-9);
  for (const dvec3& p : mesh.positions) EXPECT_TRUE(std::isfinite(p.x));
}

TEST(Subdivide, FacesThatMeetInAPointAloneDoNotHurt) {
  SourceMesh cage = cube_cage();
  const SourceMesh other = cube_cage();
  for (const dvec3& p : other.positions) cage.positions.push_back(p + dvec3(2));
  for (const uint32_t c : other.corner_position) cage.corner_position.push_back(c == 0 ? 6 : c + 8);
  for (int face = 1; face <= 6; ++face) cage.face_begin.push_back(static_cast<uint32_t>(24 + 4 * face));
  cage.face_material.resize(12, 0);
  const SourceMesh mesh = refined(cage, catmull_clark());
  expect_watertight(mesh);
  for (const dvec3& p : mesh.positions) EXPECT_TRUE(std::isfinite(p.x));
}

TEST(Subdivide, CreasesWithoutEdgeAreIgnored) {
  SourceMesh cage = cube_cage();
  cage.positions.push_back(dvec3(9));
  cage.cage.crease_edges = {{0, 6}, {0, 0}, {0, 8}};
  cage.cage.crease_sharpness = {1, 1, 1};
  cage.cage.sharp_vertices = {8};
  cage.cage.vertex_sharpness = {1};
  const SourceMesh mesh = refined(cage, catmull_clark());
  EXPECT_TRUE(has_warning(mesh, "3 creases lie where the cage has no edge"));
  EXPECT_TRUE(has_warning(mesh, "1 sharp corners of the cage belong to no face"));
  EXPECT_EQ(mesh.positions, refined(cube_cage(), catmull_clark()).positions);
}

TEST(Subdivide, LoopRefusesWhatIsNoTriangle) {
  const auto mesh = subdivide(cube_cage(), loop(), "cube.obj");
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(mesh.error().message.find("cube.obj: 6 of 6 faces are no triangles"), std::string::npos);
  EXPECT_TRUE(has_warning(refined(icosahedron_cage(), catmull_clark()), "mostly triangles"));
}

TEST(Subdivide, OptionsOutOfRangeAreRefused) {
  for (const double error : {0.0, 1e-9, -1.0, static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
    const auto mesh = subdivide(cube_cage(), catmull_clark(error), "cube");
    ASSERT_FALSE(mesh) << error;
    EXPECT_EQ(mesh.error().code, ErrorCode::InvalidArgument);
  }
  SubdivisionOptions options = catmull_clark();
  options.edge = -1;
  EXPECT_FALSE(subdivide(cube_cage(), options, "cube"));
}

TEST(Subdivide, VerticesThatTheFormatDoublesAreOne) {
  SourceMesh cage;  // each triangle of a tetrahedron with vertices of its own, as glTF has it for flat normals
  for (const uint32_t v : tetrahedron_cage().corner_position) cage.positions.push_back(tetrahedron_cage().positions[v]);
  for (uint32_t i = 0; i < 12; ++i) cage.corner_position.push_back(i);
  cage.face_begin = {0, 3, 6, 9, 12};
  cage.face_material.assign(4, 0);
  cage.materials.resize(1);
  cage.is_split = true;
  const SourceMesh mesh = refined(cage, loop());
  expect_watertight(mesh);
  EXPECT_LT(distance_to_nearest(mesh, tetrahedron_cage().positions[0] / 5.0), 1e-12);
}

TEST(Subdivide, PointsOfManyFacesTakeTheirTimeAndMoreAreRefused) {
  const SourceMesh mesh = refined(fan_cage(100), catmull_clark());
  expect_watertight(mesh);
  for (const SourceMesh& cage : {fan_cage(2049), drum_cage(2049, 1)}) {
    const auto refused = subdivide(cage, catmull_clark(), "pole.obj");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    EXPECT_NE(refused.error().message.find("2049"), std::string::npos);
  }
}

TEST(Subdivide, HearsACancel) {
  const std::atomic<bool> cancel{true};
  const auto mesh = subdivide(cube_cage(), catmull_clark(), "cube", {{}, &cancel});
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::Cancelled);
}

// ---- several schemes in one mesh

/// A cube and, 4 to its right, another one.
SourceMesh two_cubes(std::optional<SubdivisionScheme> first, std::optional<SubdivisionScheme> second) {
  SourceMesh mesh = cube_cage(), other = cube_cage();
  for (const dvec3& p : other.positions) mesh.positions.push_back(p + dvec3(4, 0, 0));
  for (const uint32_t v : other.corner_position) mesh.corner_position.push_back(8 + v);
  for (int face = 0; face < 6; ++face) {
    mesh.face_begin.push_back(mesh.face_begin.back() + 4);
    mesh.face_material.push_back(0);
  }
  mesh.face_scheme.assign(6, first);
  mesh.face_scheme.resize(12, second);
  return mesh;
}

TEST(Subdivide, EachFaceFollowsItsOwnScheme) {
  const SourceMesh mesh =
      refined(two_cubes(SubdivisionScheme::None, SubdivisionScheme::CatmullClark), SubdivisionOptions{});
  size_t flat = 0;
  for (size_t face = 0; face < mesh.face_count(); ++face) {
    const bool is_left = corner(mesh, mesh.face_begin[face]).x < 2;
    flat += is_left;
    EXPECT_EQ(is_left, mesh.face_number[face] < 6);
    if (is_left) continue;
    for (uint32_t i = mesh.face_begin[face]; i < mesh.face_begin[face + 1]; ++i) {
      EXPECT_LT(glm::length(corner(mesh, i) - dvec3(4, 0, 0)), 0.95) << "a round cube";
    }
  }
  EXPECT_EQ(flat, 6u);
  expect_watertight(mesh);
}

TEST(Subdivide, WithoutOneOfTheirOwnFacesFollowTheCallers) {
  SubdivisionOptions options = catmull_clark();
  options.scheme = SubdivisionScheme::None;
  const SourceMesh said = refined(two_cubes(SubdivisionScheme::CatmullClark, SubdivisionScheme::CatmullClark), options);
  options.scheme = SubdivisionScheme::CatmullClark;
  const SourceMesh asked = refined(two_cubes(std::nullopt, std::nullopt), options);
  EXPECT_EQ(said.positions, asked.positions);
  EXPECT_EQ(said.corner_normal, asked.corner_normal);
  const SourceMesh mixed = refined(two_cubes(SubdivisionScheme::None, std::nullopt), options);
  EXPECT_LT(mixed.face_count(), asked.face_count());
}

TEST(Subdivide, TagsStayWithTheFacesOfTheirScheme) {
  SourceMesh mesh = two_cubes(SubdivisionScheme::None, SubdivisionScheme::CatmullClark);
  for (uint32_t v : {8u, 9u, 10u, 11u}) {
    mesh.cage.crease_edges.emplace_back(v, v == 11 ? 8 : v + 1);
    mesh.cage.crease_sharpness.push_back(kInfiniteSharpness);
    mesh.cage.sharp_vertices.push_back(v);
    mesh.cage.vertex_sharpness.push_back(kInfiniteSharpness);
  }
  mesh.cage.holes = {7};  // above, of the right cube
  const SourceMesh out = refined(mesh, SubdivisionOptions{});
  EXPECT_TRUE(out.warnings.empty());
  EXPECT_LT(distance_to_nearest(out, {3, -1, -1}), 1e-12) << "a sharp corner stays";
  EXPECT_TRUE(std::ranges::none_of(out.face_number, [](uint32_t face) { return face == 7; }));
}

}  // namespace
}  // namespace farfield
