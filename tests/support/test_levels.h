// SPDX-License-Identifier: Apache-2.0
// Small levels made in memory, for tests of what rays see.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/random.h"
#include "base/vec.h"
#include "cache/level.h"

namespace farfield::testing {

struct Triangle {
  uint32_t a, b, c;
};

/// An empty level k of resolution r.
inline LevelData empty_level(uint32_t k, float resolution) {
  LevelData level;
  level.header.level = k;
  level.header.resolution = resolution;
  return level;
}

/// Puts triangles into a level as lone quads; room for Embree to read past the last position.
inline void set_triangles(LevelData& level, std::vector<vec3> positions, const std::vector<Triangle>& triangles) {
  level.positions = std::move(positions);
  level.positions.reserve(level.positions.size() + 2);
  for (const Triangle& t : triangles) {
    level.quad_first_face.push_back(static_cast<uint32_t>(level.quads.size()));
    level.quads.push_back({t.a, t.b, t.c, t.c});
  }
  for (const vec3& p : level.positions) level.header.bounds.extend(p);
}

/// Puts quads of two faces each into a level.
inline void set_quads(LevelData& level, std::vector<vec3> positions, const std::vector<Quad>& quads) {
  level.positions = std::move(positions);
  level.positions.reserve(level.positions.size() + 2);
  for (const Quad& quad : quads) {
    level.quad_first_face.push_back(static_cast<uint32_t>(2 * level.quads.size()));
    level.quads.push_back(quad);
  }
  for (const vec3& p : level.positions) level.header.bounds.extend(p);
}

inline vec3 random_unit(Rng& rng) {
  const float z = 1.0f - 2.0f * rng.next();
  const float phi = 2.0f * kPi * rng.next();
  const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

/// `count` random triangles of size about `size` in the unit cube.
inline LevelData triangle_soup(uint32_t count, float size, uint64_t seed) {
  Rng rng(seed);
  std::vector<vec3> positions;
  std::vector<Triangle> triangles;
  for (uint32_t i = 0; i < count; ++i) {
    const vec3 center(rng.next(), rng.next(), rng.next());
    for (int corner = 0; corner < 3; ++corner) positions.push_back(center + size * rng.next() * random_unit(rng));
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  LevelData level = empty_level(0, size);
  set_triangles(level, std::move(positions), triangles);
  return level;
}

/// A closed sphere of quads, latitude-longitude, the poles as lone triangles' stand-ins (quads with v2 == v3).
inline LevelData sphere_level(const vec3& center, float radius, uint32_t rings, uint32_t k = 0,
                              float resolution = 0.1f) {
  const uint32_t sectors = 2 * rings;
  std::vector<vec3> positions{center + vec3(0, 0, radius), center - vec3(0, 0, radius)};
  for (uint32_t ring = 1; ring < rings; ++ring) {
    const float theta = kPi * static_cast<float>(ring) / static_cast<float>(rings);
    for (uint32_t sector = 0; sector < sectors; ++sector) {
      const float phi = 2.0f * kPi * static_cast<float>(sector) / static_cast<float>(sectors);
      positions.push_back(
          center + radius * vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
    }
  }
  const auto at = [&](uint32_t ring, uint32_t sector) { return 2 + (ring - 1) * sectors + sector % sectors; };
  LevelData level = empty_level(k, resolution);
  uint32_t face = 0;
  const auto add = [&](const Quad& quad) {
    level.quad_first_face.push_back(face);
    level.quads.push_back(quad);
    face += quad.is_pair() ? 2 : 1;
  };
  for (uint32_t sector = 0; sector < sectors; ++sector) {
    add({0, at(1, sector), at(1, sector + 1), at(1, sector + 1)});
    for (uint32_t ring = 1; ring + 1 < rings; ++ring) {
      add({at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1), at(ring, sector + 1)});
    }
    add({1, at(rings - 1, sector + 1), at(rings - 1, sector), at(rings - 1, sector)});
  }
  level.positions = std::move(positions);
  level.positions.reserve(level.positions.size() + 2);
  for (const vec3& p : level.positions) level.header.bounds.extend(p);
  return level;
}

/// Adds a brick volume of `dims` bricks, lower corner at `origin`. density(x, y, z) in 1 / scene unit is sampled per
/// voxel; sggx(x, y, z), if given, too.
inline void set_volume(LevelData& level, const ivec3& dims, const vec3& origin,
                       const std::function<float(int, int, int)>& density,
                       const std::function<SymMat3(int, int, int)>& sggx = nullptr) {
  level.header.brick_dims = dims;
  level.header.volume_origin = origin;
  for (int bz = 0; bz < dims.z; ++bz) {
    for (int by = 0; by < dims.y; ++by) {
      for (int bx = 0; bx < dims.x; ++bx) {
        Brick brick{};
        std::vector<float> values(kBrickVoxels);
        float largest = 0.0f;
        for (int i = 0; i < kBrickVoxels; ++i) {
          const ivec3 v(bx * 8 + i % 8, by * 8 + i / 8 % 8, bz * 8 + i / 64);
          values[static_cast<size_t>(i)] = density(v.x, v.y, v.z);
          largest = std::max(largest, values[static_cast<size_t>(i)]);
        }
        if (largest <= 0.0f) {
          level.brick_table.push_back(kNoBrick);
          continue;
        }
        brick.density_scale = largest;
        brick.payload_base = voxel_count(level);
        uint16_t before = 0;
        for (int i = 0; i < kBrickVoxels; ++i) {
          if (i % 64 == 0) brick.prefix[static_cast<size_t>(i / 64)] = before;
          const float value = values[static_cast<size_t>(i)];
          if (value <= 0.0f) continue;
          brick.density[static_cast<size_t>(i)] =
              static_cast<uint8_t>(std::max(1.0f, std::round(value / largest * 255.0f)));
          brick.mask[static_cast<size_t>(i / 64)] |= uint64_t{1} << (i % 64);
          ++before;
          if (sggx)
            level.voxel_sggx.push_back(pack_flake_sggx(sggx(bx * 8 + i % 8, by * 8 + i / 8 % 8, bz * 8 + i / 64)));
        }
        level.brick_table.push_back(static_cast<uint32_t>(level.bricks.size()));
        level.bricks.push_back(brick);
      }
    }
  }
  level.header.bounds.extend(origin);
  level.header.bounds.extend(origin + level.header.resolution * vec3(dims * kBrickSide));
}

/// The attenuation coefficient that voxel (x, y, z) really has after packing, towards unit direction w.
inline double attenuation(const LevelData& level, const ivec3& voxel, const vec3& w) {
  const ivec3 n = level.header.brick_dims;
  const ivec3 b = voxel / kBrickSide;
  const uint32_t index = level.brick_table[static_cast<size_t>(b.x + n.x * (b.y + n.y * b.z))];
  if (index == kNoBrick) return 0.0;
  const Brick& brick = level.bricks[index];
  const ivec3 local = voxel - b * kBrickSide;
  const int i = local.x + 8 * (local.y + 8 * local.z);
  const uint8_t density = brick.density[static_cast<size_t>(i)];
  if (density == 0) return 0.0;
  const double rho = density / 255.0 * static_cast<double>(brick.density_scale);
  if (level.voxel_sggx.empty()) return rho;
  const SymMat3 s = unpack(level.voxel_sggx[brick.payload_index(i)]);
  return rho * std::sqrt(std::max(0.0, static_cast<double>(s.quadratic(w))));
}

/// Optical depth from t = 0 to t_end by brute force: `steps` midpoints.
inline double optical_depth(const LevelData& level, const vec3& origin, const vec3& direction, double t_end,
                            int steps = 20000) {
  const double speed = glm::length(glm::dvec3(direction));
  const vec3 w = direction / static_cast<float>(speed);
  const ivec3 count = level.header.brick_dims * kBrickSide;
  double depth = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double t = t_end * (i + 0.5) / steps;
    const glm::dvec3 p = (glm::dvec3(origin) + t * glm::dvec3(direction) - glm::dvec3(level.header.volume_origin)) /
                         static_cast<double>(level.header.resolution);
    const ivec3 voxel(glm::floor(p));
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis) inside = inside && voxel[axis] >= 0 && voxel[axis] < count[axis];
    if (inside) depth += attenuation(level, voxel, w) * speed * t_end / steps;
  }
  return depth;
}

}  // namespace farfield::testing
