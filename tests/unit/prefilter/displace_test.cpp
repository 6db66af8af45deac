// SPDX-License-Identifier: Apache-2.0
// Displaced surfaces against closed forms, and what they owe their users: no cracks, a bounded error, one answer.
#include "prefilter/displace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "base/parallel.h"
#include "evaluate/triangle_distance.h"
#include "prefilter/subdivide.h"
#include "tests/support/cages.h"
#include "tests/support/watertight.h"

namespace farfield {
namespace {

using namespace test;
using glm::dvec2;

constexpr double kTau = 6.283185307179586;

SourceHeights heights_of(int side, const std::function<double(double, double)>& height) {
  std::vector<float> values;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) values.push_back(static_cast<float>(height((x + 0.5) / side, (y + 0.5) / side)));
  }
  SourceHeights out;
  out.map = std::make_shared<const HeightMap>(side, side, std::move(values));
  out.name = "heights.exr";
  return out;
}

SourceHeights flat(double height) {
  return heights_of(1, [=](double, double) { return height; });
}

SourceHeights noise(int side, double amplitude) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(-amplitude, amplitude);
  return heights_of(side, [&](double, double) { return value(random); });
}

SourceMesh with_heights(SourceMesh mesh, SourceHeights heights) {
  mesh.heights.assign(mesh.materials.size(), std::move(heights));
  return mesh;
}

/// Each face has the whole map.
SourceMesh with_islands(SourceMesh mesh) {
  constexpr vec2 kCorners[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.corner_uv.clear();
  for (size_t face = 0; face < mesh.face_count(); ++face) {
    for (uint32_t i = mesh.face_begin[face]; i < mesh.face_begin[face + 1]; ++i) {
      mesh.corner_uv.push_back(kCorners[(i - mesh.face_begin[face]) % 4]);
    }
  }
  return mesh;
}

SubdivisionOptions on_grid(uint32_t grid, SubdivisionScheme scheme = SubdivisionScheme::None) {
  SubdivisionOptions options;
  options.scheme = scheme;
  options.grid = grid;
  return options;
}

SourceMesh displaced(const SourceMesh& mesh, const SubdivisionOptions& options) {
  auto result = subdivide(mesh, options, "mesh.obj");
  EXPECT_TRUE(result) << result.error().message;
  return result ? std::move(*result) : SourceMesh{};
}

dvec3 at_corner(const SourceMesh& mesh, size_t corner) { return mesh.positions[mesh.corner_position[corner]]; }

/// Calls visit(point, uv) for points inside triangles of the faces.
template <typename Visit>
void for_points_of_faces(const SourceMesh& mesh, const Visit& visit) {
  constexpr double kWeights[][3] = {{1. / 3, 1. / 3, 1. / 3}, {0.6, 0.3, 0.1}, {0.1, 0.1, 0.8}, {0.5, 0.5, 0}};
  for (size_t face = 0; face < mesh.face_count(); ++face) {
    const uint32_t begin = mesh.face_begin[face], end = mesh.face_begin[face + 1];
    for (uint32_t i = begin + 1; i + 1 < end; ++i) {
      for (const auto& w : kWeights) {
        visit(w[0] * at_corner(mesh, begin) + w[1] * at_corner(mesh, i) + w[2] * at_corner(mesh, i + 1),
              w[0] * dvec2(mesh.corner_uv[begin]) + w[1] * dvec2(mesh.corner_uv[i]) +
                  w[2] * dvec2(mesh.corner_uv[i + 1]));
      }
    }
  }
}

/// The farthest that vertices of `fine`, every 211th of them, lie from the faces of `coarse`.
double farthest(const SourceMesh& fine, const SourceMesh& coarse) {
  double most = 0;
  for (size_t v = 0; v < fine.positions.size(); v += 211) {
    double least = INFINITY;
    for (size_t face = 0; face < coarse.face_count(); ++face) {
      const uint32_t begin = coarse.face_begin[face], end = coarse.face_begin[face + 1];
      for (uint32_t i = begin + 1; i + 1 < end; ++i) {
        least = std::min(least, distance_to_triangle(fine.positions[v], at_corner(coarse, begin), at_corner(coarse, i),
                                                     at_corner(coarse, i + 1)));
      }
    }
    most = std::max(most, least);
  }
  return most;
}

bool has_warning(const SourceMesh& mesh, const std::string& text) {
  return std::ranges::any_of(mesh.warnings, [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

// ---- closed forms

double waves(double u, double v) { return 0.03 * std::sin(2 * kTau * u) * std::cos(kTau * v); }

TEST(Displace, APlaneFollowsItsHeightsWithinTheErrorAndInNoMoreFacesThanTheyNeed) {
  const SourceMesh mesh = displaced(with_heights(grid_cage(1), heights_of(512, waves)), on_grid(256));
  double most = 0;
  for_points_of_faces(mesh, [&](const dvec3& p, const dvec2& uv) {
    EXPECT_NEAR(p.x, uv.x, 1e-6);
    EXPECT_NEAR(p.y, uv.y, 1e-6);
    most = std::max(most, std::abs(p.z - waves(p.x, p.y)));
  });
  EXPECT_LT(most, 0.125 / 256);
  EXPECT_GT(most, 0.01 / 256) << "cut far more finely than asked";
  EXPECT_LT(mesh.face_count(), 256u * 256u / 4) << "waves need fewer faces than one per voxel";
}

TEST(Displace, NormalsAreThoseOfTheDisplacedSurface) {
  const SourceMesh mesh = displaced(with_heights(grid_cage(1), heights_of(512, waves)), on_grid(256));
  for (size_t i = 0; i < mesh.corner_count(); ++i) {
    const dvec3 p = at_corner(mesh, i);
    if (std::min(p.x, p.y) < 0.02 || std::max(p.x, p.y) > 0.98) continue;  // the map repeats, the plane does not
    constexpr double kStep = 1e-5;
    const dvec3 n = glm::normalize(dvec3((waves(p.x - kStep, p.y) - waves(p.x + kStep, p.y)) / (2 * kStep),
                                         (waves(p.x, p.y - kStep) - waves(p.x, p.y + kStep)) / (2 * kStep), 1));
    ASSERT_GT(glm::dot(n, dvec3(mesh.corner_normal[i])), std::cos(0.06)) << p.x << " " << p.y;
  }
}

TEST(Displace, ACubeRaisedByOneHeightIsALargerCube) {
  const SourceMesh mesh = displaced(with_heights(with_islands(cube_cage()), flat(0.25)), on_grid(64));
  EXPECT_EQ(open_edges(mesh), 0u);
  for (const uint32_t v : mesh.corner_position) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(std::abs(mesh.positions[v][c]), 1.25, 1e-9);
  }
  for (size_t i = 0; i < mesh.corner_count(); ++i) {
    EXPECT_NEAR(glm::length(mesh.corner_normal[i]), 1, 1e-6);
    EXPECT_NEAR(std::max({std::abs(mesh.corner_normal[i].x), std::abs(mesh.corner_normal[i].y),
                          std::abs(mesh.corner_normal[i].z)}),
                1, 1e-6)
        << "sharp edges stay sharp";
  }
}

TEST(Displace, ACubeOfSeamsStaysClosedUnderNoise) {
  for (const auto scheme : {SubdivisionScheme::None, SubdivisionScheme::CatmullClark}) {
    const SourceMesh mesh = displaced(with_heights(with_islands(cube_cage()), noise(64, 0.1)), on_grid(64, scheme));
    EXPECT_GT(mesh.face_count(), 10000u);
    EXPECT_EQ(open_edges(mesh), 0u);
  }
}

/// Triangles of a ball with radial normals, each with uv of its own.
SourceMesh ball() {
  SourceMesh mesh = with_islands(icosahedron_cage());
  for (dvec3& p : mesh.positions) p = glm::normalize(p);
  for (const uint32_t v : mesh.corner_position) mesh.corner_normal.emplace_back(mesh.positions[v]);
  return mesh;
}

TEST(Displace, SmoothPolygonsMoveAlongTheirNormals) {
  const SourceMesh mesh = displaced(with_heights(ball(), flat(0.2)), on_grid(64));
  ASSERT_EQ(mesh.face_count(), 20u) << "one height needs no more faces";
  for (size_t i = 0; i < mesh.corner_count(); ++i) {
    EXPECT_NEAR(glm::length(at_corner(mesh, i)), 1.2, 1e-6);
    EXPECT_GT(glm::dot(glm::normalize(at_corner(mesh, i)), dvec3(mesh.corner_normal[i])), 1 - 1e-6);
  }
}

TEST(Displace, ACageMovesAlongItsLimitNormals) {
  const SourceMesh cage = with_islands(cube_cage());
  const auto options = on_grid(64, SubdivisionScheme::CatmullClark);
  const SourceMesh before = displaced(cage, options);
  const SourceMesh after = displaced(with_heights(cage, flat(0.1)), options);
  ASSERT_EQ(before.corner_position, after.corner_position);
  for (size_t i = 0; i < before.corner_count(); ++i) {
    const dvec3 moved = at_corner(after, i) - at_corner(before, i);
    EXPECT_NEAR(glm::length(moved), 0.1, 1e-6);
    EXPECT_GT(glm::dot(moved / 0.1, dvec3(before.corner_normal[i])), 1 - 1e-5);
    EXPECT_GT(glm::dot(after.corner_normal[i], before.corner_normal[i]), 0.99999f) << "a parallel surface";
  }
}

TEST(Displace, DisplacedCagesKeepWithinTheErrorOfTheFinelyCutOne) {
  // No height at the rims of islands: where it jumps, what lies between depends on the size of faces.
  const auto heights =
      heights_of(256, [](double u, double v) { return 0.03 * std::sin(2 * kTau * u) * std::sin(kTau * v); });
  const SourceMesh cage = with_heights(with_islands(cube_cage()), heights);
  const SourceMesh coarse = displaced(cage, on_grid(128, SubdivisionScheme::CatmullClark));
  SubdivisionOptions fine_options = on_grid(128, SubdivisionScheme::CatmullClark);
  fine_options.error = 1e-3;
  fine_options.detail = 0.5;
  const SourceMesh fine = displaced(cage, fine_options);
  EXPECT_LT(3 * coarse.face_count(), fine.face_count());
  const double voxel = longest_side(cage) / 128;
  EXPECT_LT(farthest(fine, coarse), 0.125 * voxel * 1.3);
}

// ---- seams, borders, neighbours

TEST(Displace, SeamsOnOneSmoothSurfaceGetTheMeanOfTheirHeights) {
  SourceMesh mesh = grid_cage(2);  // materials left and right
  mesh.materials.resize(2);
  for (size_t face = 0; face < 4; ++face) mesh.face_material[face] = face % 2;
  mesh.heights = {flat(0.1), flat(0.3)};
  const SourceMesh out = displaced(mesh, on_grid(64));
  for (const dvec3& p : out.positions) {
    EXPECT_NEAR(p.z, p.x < 0.49 ? 0.1 : p.x > 0.51 ? 0.3 : 0.2, 1e-6);
  }
}

TEST(Displace, FacesWithoutAMapStayButForTheEdgesThatTheyShare) {
  SourceMesh mesh = grid_cage(4);
  mesh.materials.resize(2);
  mesh.face_material[0] = 1;
  mesh.heights = {SourceHeights{}, heights_of(64, [](double u, double v) { return 0.1 * std::sin(9 * kTau * u * v); })};
  const SourceMesh out = displaced(mesh, on_grid(128));
  size_t untouched = 0;
  for (size_t face = 0; face < out.face_count(); ++face)
    untouched += out.face_number[face] >= 6 && out.face_material[face] == 0;
  EXPECT_EQ(untouched, 10u) << "faces that share no edge with the first one come once each";
  for (const uint32_t v : out.corner_position) {
    const dvec3& p = out.positions[v];
    if (std::max(p.x, p.y) > 0.2501) {
      EXPECT_EQ(p.z, 0) << p.x << " " << p.y;
    }
  }
}

TEST(Displace, PolygonsOfManyCornersAndConcaveOnesKeepTheirArea) {
  // An L of six corners and an arrow of four, in z = 0.
  SourceMesh mesh = cage_of(
      {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}, {3, 0, 0}, {5, 1, 0}, {3, 2, 0}, {3.5, 1, 0}},
      {{0, 1, 2, 3, 4, 5}, {6, 7, 8, 9}});
  for (const uint32_t v : mesh.corner_position) mesh.corner_uv.emplace_back(vec3(mesh.positions[v]));
  const SourceMesh out = displaced(with_heights(mesh, flat(0.5)), on_grid(64));
  double area = 0;
  for (size_t face = 0; face < out.face_count(); ++face) {
    const uint32_t begin = out.face_begin[face], end = out.face_begin[face + 1];
    for (uint32_t i = begin + 1; i + 1 < end; ++i) {
      const dvec3 n =
          glm::cross(at_corner(out, i) - at_corner(out, begin), at_corner(out, i + 1) - at_corner(out, begin));
      EXPECT_GE(n.z, 0);
      area += 0.5 * n.z;
    }
    for (uint32_t i = begin; i < end; ++i) EXPECT_NEAR(at_corner(out, i).z, 0.5, 1e-6);
  }
  EXPECT_NEAR(area, 3 + 1.5, 1e-9);
}

TEST(Displace, VerticesThatAFileDoublesMoveTogether) {
  SourceMesh mesh = with_islands(cube_cage());  // each face with points of its own
  std::vector<dvec3> own;
  for (uint32_t& v : mesh.corner_position) {
    own.push_back(mesh.positions[v]);
    v = static_cast<uint32_t>(own.size() - 1);
  }
  mesh.positions = own;
  EXPECT_EQ(open_edges(displaced(with_heights(mesh, noise(32, 0.1)), on_grid(64))), 0u);
}

// ---- detail

TEST(Displace, DetailBelowWhatIsAskedForBecomesItsMean) {
  const auto checker = heights_of(
      256, [](double u, double v) { return (static_cast<int>(256 * u) + static_cast<int>(256 * v)) % 2 ? 0.2 : 0.0; });
  const SourceMesh mesh = displaced(with_heights(grid_cage(1), checker), on_grid(32));  // 8 texels per voxel
  for (const uint32_t v : mesh.corner_position) EXPECT_NEAR(mesh.positions[v].z, 0.1, 1e-6);
  EXPECT_EQ(mesh.face_count(), 1u);
}

TEST(Displace, ABumpInACornerOfALargeFaceIsNotMissed) {
  const auto bump = heights_of(512, [](double u, double v) {
    return 0.05 * std::exp(-2000 * ((u - 0.93) * (u - 0.93) + (v - 0.11) * (v - 0.11)));
  });
  const SourceMesh mesh = displaced(with_heights(grid_cage(1), bump), on_grid(256));
  double highest = 0;
  for (const uint32_t v : mesh.corner_position) highest = std::max(highest, mesh.positions[v].z);
  EXPECT_NEAR(highest, 0.05, 0.002);
}

TEST(Displace, NoiseIsCutDownToTexelsAndNoFurther) {
  const SourceMesh mesh = displaced(with_heights(grid_cage(1), noise(32, 0.1)), on_grid(1024));
  EXPECT_EQ(mesh.face_count(), 32u * 32u);
}

TEST(Displace, TooManyFacesAreSaidAndDetailIsGivenUp) {
  SubdivisionOptions options = on_grid(512);
  options.most_faces = 5000;
  const SourceMesh mesh = displaced(with_heights(grid_cage(1), noise(512, 0.1)), options);
  EXPECT_LE(mesh.face_count(), 5000u);
  EXPECT_GT(mesh.face_count(), 1000u);
  EXPECT_TRUE(has_warning(mesh, "the displaced surface would take more than 5000 faces"));
  double highest = 0;
  for (const uint32_t v : mesh.corner_position) highest = std::max(highest, std::abs(mesh.positions[v].z));
  EXPECT_LT(highest, 0.06) << "means of noise, not samples";
}

// ---- one answer

TEST(Displace, TurnedAndMovedItIsTheSame) {
  const SourceMesh mesh = with_heights(with_islands(cube_cage()), heights_of(128, waves));
  const glm::dmat3 turn(dvec3(0, 1, 0), dvec3(0, 0, 1), dvec3(1, 0, 0));
  const dvec3 by(3, -2, 8);
  SourceMesh other = mesh;
  for (dvec3& p : other.positions) p = turn * p + by;
  for (const auto scheme : {SubdivisionScheme::None, SubdivisionScheme::CatmullClark}) {
    const SourceMesh here = displaced(mesh, on_grid(128, scheme)), there = displaced(other, on_grid(128, scheme));
    ASSERT_EQ(here.corner_position, there.corner_position);
    for (size_t i = 0; i < here.corner_count(); ++i) {
      EXPECT_LT(glm::length(turn * at_corner(here, i) + by - at_corner(there, i)), 1e-6);
      EXPECT_LT(glm::length(turn * dvec3(here.corner_normal[i]) - dvec3(there.corner_normal[i])), 1e-4);
    }
  }
}

TEST(Displace, ThreadsDoNotMatter) {
  const SourceMesh mesh = with_heights(with_islands(cube_cage()), noise(64, 0.1));
  SourceMesh of[2];
  for (int i = 0; i < 2; ++i) {
    const ThreadLimit threads(i == 0 ? 1 : 4);
    of[i] = displaced(mesh, on_grid(64, SubdivisionScheme::CatmullClark));
  }
  EXPECT_EQ(of[0].positions, of[1].positions);
  EXPECT_EQ(of[0].corner_position, of[1].corner_position);
  EXPECT_EQ(of[0].corner_normal, of[1].corner_normal);
}

// ---- extremes

TEST(Displace, WithoutMapsOrUnaskedAMeshComesBackAsItIs) {
  const SourceMesh mesh = with_islands(cube_cage());
  EXPECT_EQ(displaced(mesh, on_grid(64)).corner_position, mesh.corner_position);
  SubdivisionOptions options = on_grid(64);
  options.displace = false;
  const SourceMesh same = displaced(with_heights(mesh, flat(0.3)), options);
  EXPECT_EQ(same.positions, mesh.positions);
  EXPECT_EQ(same.corner_position, mesh.corner_position);
}

TEST(Displace, FacesWithoutTextureCoordinatesAreSaidAndStay) {
  SourceMesh mesh = with_heights(cube_cage(), flat(0.3));
  mesh.materials[0].name = "bark";
  const SourceMesh none = displaced(mesh, on_grid(64));
  EXPECT_EQ(none.positions, mesh.positions);
  EXPECT_TRUE(has_warning(none, "material bark: 6 faces have no texture coordinates for heights.exr; not displaced"));

  mesh = with_heights(with_islands(cube_cage()), flat(0.25));
  mesh.corner_uv[0].x = std::numeric_limits<float>::quiet_NaN();
  const SourceMesh some = displaced(mesh, on_grid(64));
  EXPECT_TRUE(has_warning(some, "1 faces have no texture coordinates"));
  EXPECT_EQ(open_edges(some), 0u);
}

TEST(Displace, HeightsFarBeyondTheMeshAreRefusedWithTheRemedyAndLargeOnesSaid) {
  SourceMesh mesh = with_islands(cube_cage());
  mesh.materials[0].name = "bark";
  for (const double height : {1e3, -1e3, 1e30}) {
    const auto refused = subdivide(with_heights(mesh, flat(height)), on_grid(64), "tree.obj");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::BadFile);
    for (const char* part : {"tree.obj", "bark", "heights.exr", "-bm", "--no-displacement"}) {
      EXPECT_NE(refused.error().message.find(part), std::string::npos) << refused.error().message;
    }
  }
  EXPECT_TRUE(has_warning(displaced(with_heights(mesh, flat(1)), on_grid(64)), "bark: displaced by heights.exr to 1"));
  EXPECT_TRUE(displaced(with_heights(mesh, flat(0.1)), on_grid(64)).warnings.empty());
}

TEST(Displace, ZeroHeightsChangeNothing) {
  const SourceMesh mesh = displaced(with_heights(with_islands(cube_cage()), flat(0)), on_grid(64));
  EXPECT_EQ(mesh.face_count(), 6u);
  for (const uint32_t v : mesh.corner_position) {
    for (int c = 0; c < 3; ++c) EXPECT_EQ(std::abs(mesh.positions[v][c]), 1);
  }
}

TEST(Displace, BladesDoNotFlyAway) {
  // Two quads back to back along a knife's edge of 2 degrees.
  SourceMesh mesh =
      with_islands(cage_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0.0175}, {1, 1, 0.0175}, {0, 1, -0.0175}, {1, 1, -0.0175}},
                           {{0, 1, 3, 2}, {1, 0, 4, 5}}));
  const SourceMesh out = displaced(with_heights(mesh, flat(0.1)), on_grid(64));
  for (const uint32_t v : out.corner_position) {
    EXPECT_GT(out.positions[v].y, -0.05);
    EXPECT_LT(std::abs(out.positions[v].z), 0.13);
  }
}

TEST(Displace, FacesThatAreDegenerateOrNotFiniteAreLeftOut) {
  SourceMesh mesh = with_islands(cage_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {NAN, 0, 0}, {2, 0, 0}},
                                         {{0, 1, 2, 3}, {0, 1, 4}, {0, 1, 1, 1}, {0, 1, 5}}));
  const SourceMesh out = displaced(with_heights(mesh, flat(0.1)), on_grid(64));
  for (const uint32_t v : out.corner_position) EXPECT_TRUE(std::isfinite(out.positions[v].z));
}

}  // namespace
}  // namespace farfield
