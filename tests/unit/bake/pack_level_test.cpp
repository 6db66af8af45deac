// SPDX-License-Identifier: Apache-2.0
#include "bake/pack_level.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "cache/level_check.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using test::leaf_cloud;
using test::LeafCloud;

/// A grid of squares in the xy plane, split along alternating diagonals, with bumps.
Surface bumpy_grid(int side) {
  Surface surface;
  Rng rng(3);
  for (int y = 0; y <= side; ++y) {
    for (int x = 0; x <= side; ++x) surface.positions.emplace_back(x, y, rng.next());
  }
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const auto at = [&](int i, int j) { return static_cast<uint32_t>((y + j) * (side + 1) + x + i); };
      if ((x + y) % 2) {
        surface.triangles.push_back({at(0, 0), at(1, 0), at(1, 1)});
        surface.triangles.push_back({at(0, 0), at(1, 1), at(0, 1)});
      } else {
        surface.triangles.push_back({at(0, 0), at(1, 0), at(0, 1)});
        surface.triangles.push_back({at(1, 0), at(1, 1), at(0, 1)});
      }
    }
  }
  for (const uvec3& t : surface.triangles) {
    const vec3 a = surface.positions[t.x], b = surface.positions[t.y], c = surface.positions[t.z];
    FaceMaterial material;
    material.sggx = SymMat3::outer(glm::normalize(glm::cross(b - a, c - a)));
    material.diffuse = vec3(rng.next(), rng.next(), rng.next());
    surface.materials.push_back(material);
  }
  return surface;
}

/// A triangle by its corner positions, the least corner first, so that rotations are equal and mirrored ones are not.
using Corners = std::array<std::array<float, 3>, 3>;
Corners corners_of(const Surface& surface, const uvec3& t) {
  Corners corners;
  for (int c = 0; c < 3; ++c) {
    const vec3& p = surface.positions[t[c]];
    corners[static_cast<size_t>(c)] = {p.x, p.y, p.z};
  }
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

/// The triangles that Embree makes of a level's quads, in the order of faces.
std::vector<uvec3> faces_of(const LevelData& level) {
  std::vector<uvec3> faces;
  for (size_t q = 0; q < level.quads.size(); ++q) {
    const Quad& quad = level.quads[q];
    EXPECT_EQ(level.quad_first_face[q], faces.size());
    faces.push_back({quad.v0, quad.v1, quad.v3});
    if (quad.is_pair()) faces.push_back({quad.v2, quad.v3, quad.v1});
  }
  return faces;
}

LevelData packed(const Surface& surface, SurfaceOrder* order_out = nullptr) {
  const SurfaceOrder order = order_surface(surface);
  if (order_out) *order_out = order;
  return pack_level(3, 0.5, reorder(surface, order), order, {}, {});
}

/// Albedos are rounded up or down so that their means are right.
void expect_within_a_step(PackedColor color, const vec3& wanted) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(std::abs(color.sqrt_rgb[static_cast<size_t>(i)] - 255 * std::sqrt(wanted[i])), 1.001f);
  }
}

void expect_same_triangles_and_colours(const Surface& surface) {
  SurfaceOrder order;
  const LevelData level = packed(surface, &order);
  EXPECT_EQ(find_structure_problem(view_of(level)), std::nullopt);
  EXPECT_EQ(find_value_problem(view_of(level)), std::nullopt);
  Surface unpacked;
  unpacked.positions = level.positions;
  const std::vector<uvec3> faces = faces_of(level);
  ASSERT_EQ(faces.size(), surface.triangles.size());
  std::set<uint32_t> numbers(order.face_number.begin(), order.face_number.end());
  EXPECT_EQ(numbers.size(), faces.size());
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    const uint32_t number = order.face_number[f];
    ASSERT_LT(number, faces.size());
    EXPECT_EQ(corners_of(unpacked, faces[number]), corners_of(surface, surface.triangles[f]));
    expect_within_a_step(level.face_diffuse[number], surface.materials[f].diffuse);
  }
}

TEST(PackLevel, KeepsEveryTriangleItsWindingAndItsMaterial) {
  expect_same_triangles_and_colours(bumpy_grid(20));
  expect_same_triangles_and_colours(leaf_cloud({}));
}

TEST(PackLevel, KeepsTrianglesOfHostileTopology) {
  Surface surface = bumpy_grid(4);
  const auto add = [&](uvec3 t) {
    surface.triangles.push_back(t);
    surface.materials.push_back(surface.materials[0]);
  };
  add(surface.triangles[0]);                                                      // a duplicate
  add({surface.triangles[1].x, surface.triangles[1].z, surface.triangles[1].y});  // back to back
  add({0, 1, 24});                                                                // a third one at an edge
  add({24, 1, 7});
  surface.positions.push_back(vec3(9));  // used by none
  surface.positions.push_back(vec3(9));
  expect_same_triangles_and_colours(surface);
  EXPECT_EQ(packed(surface).positions.size(), 25u);
}

TEST(PackLevel, PairsAllLeavesAlongTheirDiagonals) {
  const LevelData level = packed(leaf_cloud({}));
  EXPECT_EQ(level.quads.size(), 4000u);
  for (const Quad& quad : level.quads) EXPECT_TRUE(quad.is_pair());
}

TEST(PackLevel, FindsTheSquaresOfAGrid) {
  // In a flat grid of rectangles the diagonals are the longest edges of both their triangles.
  Surface grid = bumpy_grid(30);
  for (vec3& p : grid.positions) p.z = 0;
  const LevelData level = packed(grid);
  EXPECT_EQ(level.quads.size(), 900u);
}

TEST(PackLevel, LeavesFewTrianglesOfAMeshAlone) {
  // Irregular: random heights change which edges are longest.
  const Surface grid = bumpy_grid(50);
  const LevelData level = packed(grid);
  EXPECT_LT(level.quads.size(), 1.03 * 2500);
}

TEST(PackLevel, NeverPairsTrianglesOfOppositeWinding) {
  Surface surface;
  surface.positions = {vec3(0), vec3(1, 0, 0), vec3(0, 1, 0), vec3(1, 1, 0)};
  surface.triangles = {uvec3(0, 1, 2), uvec3(1, 2, 3)};
  surface.materials.resize(2);
  EXPECT_EQ(packed(surface).quads.size(), 2u);
}

TEST(PackLevel, NumbersVerticesInTheOrderOfTheirUse) {
  const LevelData level = packed(bumpy_grid(20));
  uint32_t next = 0;
  for (const Quad& quad : level.quads) {
    for (const uint32_t v : {quad.v0, quad.v1, quad.v3, quad.v2}) {
      EXPECT_LE(v, next);
      if (v == next) ++next;
    }
  }
  EXPECT_EQ(next, level.positions.size());
}

TEST(PackLevel, OrdersQuadsSoThatNeighboursAreNear) {
  // Along a Morton curve the mean step is about one cell; in random order it would be half the cube.
  const LevelData level = packed(leaf_cloud({}));
  double sum = 0;
  for (size_t q = 1; q < level.quads.size(); ++q) {
    sum += glm::distance(level.positions[level.quads[q].v0], level.positions[level.quads[q - 1].v0]);
  }
  EXPECT_LT(sum / static_cast<double>(level.quads.size()), 0.12);
}

TEST(PackLevel, StoresOnlyChannelsThatAreNotDefault) {
  Surface surface = leaf_cloud({});
  LevelData level = packed(surface);
  EXPECT_TRUE(level.face_sggx.empty());  // all flat
  EXPECT_FALSE(level.face_diffuse.empty());
  EXPECT_TRUE(level.face_specular.empty());
  EXPECT_TRUE(level.face_roughness2.empty());
  EXPECT_TRUE(level.face_transmission.empty());

  surface.materials[5].specular = vec3(0.04f);
  surface.materials[5].roughness2 = 0.25f;
  surface.materials[7].transmission = vec3(0, 0.5f, 0);
  surface.materials[9].sggx = SymMat3::identity() * (1.0f / 3);
  SurfaceOrder order;
  level = packed(surface, &order);
  ASSERT_EQ(level.face_sggx.size(), 8000u);
  expect_within_a_step(level.face_specular[order.face_number[5]], vec3(0.04f));
  EXPECT_EQ(level.face_roughness2[order.face_number[5]], pack_unorm8(0.25f));
  expect_within_a_step(level.face_transmission[order.face_number[7]], vec3(0, 0.5f, 0));
  EXPECT_EQ(level.face_sggx[order.face_number[9]], pack_surface_sggx(SymMat3::identity()));

  for (FaceMaterial& m : surface.materials) m.diffuse = vec3(0);
  EXPECT_TRUE(packed(surface).face_diffuse.empty());
}

TEST(PackLevel, FindsEveryVoxelAgainThroughBricksAndRanks) {
  Surface leaves = leaf_cloud({});
  for (size_t i = 0; i < leaves.materials.size(); ++i) leaves.materials[i].transmission = vec3(i % 2 ? 0.5f : 0.0f);
  const VoxelLattice lattice{dvec3(0.5, 0.25, 0.125), 1.0 / 16};
  const SparseVolume volume = *voxelize(leaves, lattice, {});
  const LevelData level = pack_level(2, lattice.voxel_size, {}, {}, pack_volume(volume), {});
  EXPECT_EQ(find_structure_problem(view_of(level)), std::nullopt);
  EXPECT_EQ(find_value_problem(view_of(level)), std::nullopt);
  ASSERT_EQ(voxel_count(level), volume.voxels.size());
  ASSERT_EQ(level.voxel_sggx.size(), volume.voxels.size());
  EXPECT_TRUE(level.voxel_specular.empty());
  EXPECT_TRUE(level.voxel_roughness2.empty());

  const ivec3 dims = level.header.brick_dims;
  for (const VoxelBrick& source : volume.bricks) {
    // From a voxel's place in space to its payload, as a ray would.
    uint64_t index = source.first_voxel;
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (!(source.mask[static_cast<size_t>(i >> 6)] >> (i & 63) & 1)) continue;
      const Voxel& voxel = volume.voxels[index++];
      const ivec3 coordinate = source.coordinate * kBrickSide + ivec3(i & 7, i >> 3 & 7, i >> 6);
      const vec3 middle(lattice.origin + (dvec3(coordinate) + 0.5) * lattice.voxel_size);
      const vec3 place = (middle - level.header.volume_origin) / level.header.resolution;
      const ivec3 cell(glm::floor(place)), brick_at = cell / kBrickSide, in = cell % kBrickSide;
      const uint32_t entry =
          level.brick_table[static_cast<size_t>(brick_at.x + dims.x * (brick_at.y + dims.y * brick_at.z))];
      ASSERT_NE(entry, kNoBrick);
      const Brick& brick = level.bricks[entry];
      const int at = in.x + kBrickSide * (in.y + kBrickSide * in.z);
      const float density = static_cast<float>(brick.density[static_cast<size_t>(at)]) / 255 * brick.density_scale;
      ASSERT_GT(brick.density[static_cast<size_t>(at)], 0);
      EXPECT_LE(std::abs(density - voxel.density), brick.density_scale / 255 * 1.001f);
      const uint32_t payload = brick.payload_index(at);
      EXPECT_EQ(level.voxel_sggx[payload], pack_flake_sggx(voxel.sggx));
      expect_within_a_step(level.voxel_diffuse[payload], voxel.diffuse);
      expect_within_a_step(level.voxel_transmission[payload], voxel.transmission);
      const uint8_t shadowing = level.voxel_self_shadowing.empty() ? 255 : level.voxel_self_shadowing[payload];
      EXPECT_EQ(shadowing, std::max<uint8_t>(pack_unorm8(voxel.self_shadowing), 1));
    }
  }
}

TEST(PackLevel, BoundsBothSurfaceAndVolume) {
  const Surface leaves = leaf_cloud({});
  const SparseVolume volume = *voxelize(leaves, {dvec3(0), 1.0 / 8}, {});
  Surface far_triangle;
  far_triangle.positions = {vec3(5, 0, 0), vec3(6, 0, 0), vec3(5, 1, 0)};
  far_triangle.triangles = {uvec3(0, 1, 2)};
  far_triangle.materials.resize(1);
  far_triangle.materials[0].diffuse = vec3(0.5f);
  const SurfaceOrder order = order_surface(far_triangle);
  const LevelData level =
      pack_level(1, 1.0 / 8, reorder(far_triangle, order), order, pack_volume(volume), {{0, 1, 2}, {0}});
  EXPECT_EQ(find_value_problem(view_of(level)), std::nullopt);
  EXPECT_EQ(level.header.bounds.upper.x, 6);
  EXPECT_LT(level.header.bounds.lower.x, 0);  // voxels reach beyond the leaves
  EXPECT_EQ(level.morph_vertex.size(), 3u);
  EXPECT_EQ(level.header.level, 1u);
}

TEST(PackLevel, OfNothingHasNeitherSurfaceNorVolume) {
  const LevelData level = pack_level(4, 1.0, {}, order_surface({}), pack_volume({}), {});
  EXPECT_FALSE(level.has_surface());
  EXPECT_FALSE(level.has_volume());
  EXPECT_TRUE(level.header.bounds.is_empty());
}

}  // namespace
}  // namespace farfield
