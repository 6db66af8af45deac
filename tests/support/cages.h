// SPDX-License-Identifier: Apache-2.0
// Subdivision cages for tests.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "import/source_mesh.h"

namespace farfield::test {

inline SourceMesh cage_of(std::vector<dvec3> points, const std::vector<std::vector<uint32_t>>& faces) {
  SourceMesh cage;
  cage.positions = std::move(points);
  for (const auto& face : faces) {
    cage.corner_position.insert(cage.corner_position.end(), face.begin(), face.end());
    cage.face_begin.push_back(static_cast<uint32_t>(cage.corner_count()));
    cage.face_material.push_back(0);
  }
  cage.materials.resize(1);
  return cage;
}

inline double longest_side(const SourceMesh& mesh) {
  dvec3 lower(INFINITY), upper(-INFINITY);
  for (const dvec3& p : mesh.positions) lower = glm::min(lower, p), upper = glm::max(upper, p);
  const dvec3 size = upper - lower;
  return std::max(size.x, std::max(size.y, size.z));
}

/// [-1, 1]^3; points 0 to 3 at z = -1, 4 to 7 above them, faces seen from outside. Face 0 is below, 1 above.
inline SourceMesh cube_cage() {
  return cage_of({{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}},
                 {{3, 2, 1, 0}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}});
}

/// The cube with all its edges as sharp.
inline SourceMesh creased_cube_cage(float sharpness) {
  SourceMesh cage = cube_cage();
  cage.cage.crease_edges = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                            {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  cage.cage.crease_sharpness.assign(12, sharpness);
  return cage;
}

/// The square [0, 1]^2 in z = 0 as side * side quads, with itself as uv. Point (x, y) has number y (side + 1) + x.
inline SourceMesh grid_cage(uint32_t side) {
  std::vector<dvec3> points;
  std::vector<std::vector<uint32_t>> faces;
  for (uint32_t y = 0; y <= side; ++y) {
    for (uint32_t x = 0; x <= side; ++x) {
      points.emplace_back(static_cast<double>(x) / side, static_cast<double>(y) / side, 0);
      const uint32_t at = y * (side + 1) + x;
      if (x < side && y < side) faces.push_back({at, at + 1, at + side + 2, at + side + 1});
    }
  }
  SourceMesh cage = cage_of(std::move(points), faces);
  for (const uint32_t v : cage.corner_position) cage.corner_uv.emplace_back(vec3(cage.positions[v]));
  return cage;
}

/// One quad between straight sharp edges, twisted: z = x y.
inline SourceMesh saddle_cage() {
  SourceMesh cage = cage_of({{-1, -1, 1}, {1, -1, -1}, {1, 1, 1}, {-1, 1, -1}}, {{0, 1, 2, 3}});
  cage.cage.crease_edges = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};
  cage.cage.crease_sharpness.assign(4, kInfiniteSharpness);
  return cage;
}

/// A drum of `sides` quads around, closed by a polygon below and triangles that meet in a point above.
inline SourceMesh drum_cage(uint32_t sides, double height) {
  std::vector<dvec3> points;
  std::vector<std::vector<uint32_t>> faces;
  std::vector<uint32_t> bottom;
  for (uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * 3.141592653589793 * i / sides;
    points.emplace_back(std::cos(angle), std::sin(angle), 0);
    points.emplace_back(std::cos(angle), std::sin(angle), height);
    const uint32_t next = (i + 1) % sides;
    faces.push_back({2 * i, 2 * next, 2 * next + 1, 2 * i + 1});
    faces.push_back({2 * i + 1, 2 * next + 1, 2 * sides});
    bottom.push_back(2 * (sides - 1 - i));
  }
  points.emplace_back(0, 0, 1.3 * height);
  faces.push_back(bottom);
  return cage_of(std::move(points), faces);
}

/// Two cones of `sides` triangles, base to base.
inline SourceMesh fan_cage(uint32_t sides) {
  std::vector<dvec3> points;
  std::vector<std::vector<uint32_t>> faces;
  for (uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * 3.141592653589793 * i / sides;
    points.emplace_back(std::cos(angle), std::sin(angle), 0);
    const uint32_t next = (i + 1) % sides;
    faces.push_back({i, next, sides});
    faces.push_back({next, i, sides + 1});
  }
  points.emplace_back(0, 0, 0.5);
  points.emplace_back(0, 0, -0.5);
  return cage_of(std::move(points), faces);
}

inline SourceMesh tetrahedron_cage() {
  return cage_of({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}, {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}});
}

inline SourceMesh icosahedron_cage() {
  const double t = (1 + std::sqrt(5.0)) / 2;
  return cage_of({{-1, t, 0},
                  {1, t, 0},
                  {-1, -t, 0},
                  {1, -t, 0},
                  {0, -1, t},
                  {0, 1, t},
                  {0, -1, -t},
                  {0, 1, -t},
                  {t, 0, -1},
                  {t, 0, 1},
                  {-t, 0, -1},
                  {-t, 0, 1}},
                 {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                  {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                  {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}});
}

}  // namespace farfield::test
