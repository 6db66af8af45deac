// SPDX-License-Identifier: Apache-2.0
// Surfaces of known shape for the tests of the bake.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "base/vec.h"
#include "prefilter/surface.h"
#include "tests/support/random_unit.h"

namespace farfield::test {

/// Gives every face a plain material, with the geometric normal's SGGX matrix.
inline void add_materials(Surface& surface) {
  surface.materials.clear();
  for (const uvec3& t : surface.triangles) {
    const dvec3 a(surface.positions[t.x]), b(surface.positions[t.y]), c(surface.positions[t.z]);
    const dvec3 n = glm::cross(b - a, c - a);
    FaceMaterial material;
    material.sggx = glm::length(n) > 0 ? SymMat3::outer(vec3(glm::normalize(n))) : SymMat3::identity();
    material.diffuse = vec3(0.5f);
    surface.materials.push_back(material);
  }
}

/// A grid of nu x nv quads, two triangles each, at point(u, v), u and v in [0, 1]; optionally closed in u.
inline Surface make_grid(int nu, int nv, bool closed_u, const std::function<vec3(float, float)>& point) {
  Surface surface;
  const int columns = closed_u ? nu : nu + 1;
  for (int j = 0; j <= nv; ++j) {
    for (int i = 0; i < columns; ++i) {
      surface.positions.push_back(
          point(static_cast<float>(i) / static_cast<float>(nu), static_cast<float>(j) / static_cast<float>(nv)));
    }
  }
  const auto vertex = [&](int i, int j) { return static_cast<uint32_t>(j * columns + i % columns); };
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      surface.triangles.emplace_back(vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1));
      surface.triangles.emplace_back(vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1));
    }
  }
  add_materials(surface);
  return surface;
}

/// [0, width] x [0, height] in the plane z = 0.
inline Surface make_plane(int nu, int nv, float width, float height) {
  return make_grid(nu, nv, false, [=](float u, float v) { return vec3(u * width, v * height, 0.0f); });
}

/// An open tube along z.
inline Surface make_tube(int around, int along, float radius, float length) {
  return make_grid(around, along, true, [=](float u, float v) {
    return vec3(radius * std::cos(2 * kPi * u), radius * std::sin(2 * kPi * u), length * v);
  });
}

/// A torus with radii 1 and `tube` around the z axis.
inline Surface make_torus(int around, int across, float tube) {
  Surface surface;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const float phi = 2 * kPi * static_cast<float>(i) / static_cast<float>(around);
      const float theta = 2 * kPi * static_cast<float>(j) / static_cast<float>(across);
      const float radius = 1.0f + tube * std::cos(theta);
      surface.positions.emplace_back(radius * std::cos(phi), radius * std::sin(phi), tube * std::sin(theta));
    }
  }
  const auto vertex = [&](int i, int j) { return static_cast<uint32_t>((i % around) * across + j % across); };
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      surface.triangles.emplace_back(vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1));
      surface.triangles.emplace_back(vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1));
    }
  }
  add_materials(surface);
  return surface;
}

/// A closed sphere around the origin: latitude rings and two poles.
inline Surface make_sphere(int around, int rings, float radius) {
  Surface surface;
  for (int j = 1; j < rings; ++j) {
    const float theta = kPi * static_cast<float>(j) / static_cast<float>(rings);
    for (int i = 0; i < around; ++i) {
      const float phi = 2 * kPi * static_cast<float>(i) / static_cast<float>(around);
      surface.positions.push_back(
          radius * vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
    }
  }
  const uint32_t north = static_cast<uint32_t>(surface.positions.size()), south = north + 1;
  surface.positions.emplace_back(0.0f, 0.0f, radius);
  surface.positions.emplace_back(0.0f, 0.0f, -radius);
  const auto vertex = [&](int i, int j) { return static_cast<uint32_t>((j - 1) * around + i % around); };
  for (int i = 0; i < around; ++i) {
    surface.triangles.emplace_back(north, vertex(i, 1), vertex(i + 1, 1));
    for (int j = 1; j + 1 < rings; ++j) {
      surface.triangles.emplace_back(vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1));
      surface.triangles.emplace_back(vertex(i, j), vertex(i + 1, j + 1), vertex(i + 1, j));
    }
    surface.triangles.emplace_back(vertex(i, rings - 1), south, vertex(i + 1, rings - 1));
  }
  add_materials(surface);
  return surface;
}

/// Square leaves of two triangles, spread evenly over the unit cube.
struct LeafCloud {
  int count = 4000;
  float leaf_size = 0.02f;  ///< side of a square
  float flatness = 0;       ///< 0: any normal; 1: all normals along z
  uint64_t seed = 7;
};

inline Surface leaf_cloud(const LeafCloud& cloud) {
  Rng rng(cloud.seed);
  Surface surface;
  for (int i = 0; i < cloud.count; ++i) {
    const vec3 normal = glm::normalize(random_unit(rng) * (1 - cloud.flatness) + vec3(0, 0, 1) * cloud.flatness);
    const Frame frame(normal);
    const vec3 middle(rng.next(), rng.next(), rng.next());
    const auto first = static_cast<uint32_t>(surface.positions.size());
    for (const vec2 corner : {vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, 1)}) {
      surface.positions.push_back(middle + 0.5f * cloud.leaf_size * (corner.x * frame.x + corner.y * frame.y));
    }
    surface.triangles.push_back({first, first + 1, first + 2});
    surface.triangles.push_back({first, first + 2, first + 3});
    FaceMaterial material;
    material.sggx = SymMat3::outer(normal);
    material.diffuse = vec3(rng.next(), 0.5f, 0.25f);
    surface.materials.insert(surface.materials.end(), 2, material);
  }
  return surface;
}

/// Makes a quad of each two triangles that follow each other and share an edge.
inline void pair_into_quads(Surface& surface) {
  surface.quad.assign(surface.triangles.size(), 0xffffffffu);
  for (size_t f = 0; f + 1 < surface.triangles.size(); ++f) {
    int shared = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) shared += surface.triangles[f][i] == surface.triangles[f + 1][j];
    }
    if (shared != 2) continue;
    surface.quad[f] = surface.quad[f + 1] = static_cast<uint32_t>(f);
    ++f;
  }
}

/// A rounded cube from -1 to 1: six grids of side x side quads, and eight corners where three of them meet.
inline Surface make_rounded_cube(int side, float radius) {
  Surface surface;
  std::map<std::array<int, 3>, uint32_t> number;
  const auto vertex = [&](std::array<int, 3> at) {
    const auto [found, is_new] = number.try_emplace(at, static_cast<uint32_t>(surface.positions.size()));
    if (is_new) {
      vec3 p;
      for (size_t c = 0; c < 3; ++c)
        p[static_cast<int>(c)] = 2.0f * static_cast<float>(at[c]) / static_cast<float>(side) - 1;
      const vec3 inner = glm::clamp(p, vec3(radius - 1), vec3(1 - radius));
      surface.positions.push_back(radius > 0 ? inner + radius * glm::normalize(p - inner) : p);
    }
    return found->second;
  };
  for (size_t axis = 0; axis < 3; ++axis) {
    for (const int level : {0, side}) {
      for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) {
          const auto at = [&](int u, int v) {
            std::array<int, 3> p{};
            p[axis] = level;
            p[(axis + 1) % 3] = level > 0 ? u : v;  // outwards on both sides
            p[(axis + 2) % 3] = level > 0 ? v : u;
            return vertex(p);
          };
          surface.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
          surface.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
      }
    }
  }
  add_materials(surface);
  return surface;
}

/// Both surfaces in one.
inline Surface join(Surface a, const Surface& b) {
  const uint32_t offset = static_cast<uint32_t>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const uvec3& t : b.triangles) a.triangles.push_back(t + uvec3(offset));
  a.materials.insert(a.materials.end(), b.materials.begin(), b.materials.end());
  return a;
}

inline double total_area(const Surface& surface) {
  double area = 0;
  for (const uvec3& t : surface.triangles) {
    const dvec3 a(surface.positions[t.x]), b(surface.positions[t.y]), c(surface.positions[t.z]);
    area += 0.5 * glm::length(glm::cross(b - a, c - a));
  }
  return area;
}

}  // namespace farfield::test
