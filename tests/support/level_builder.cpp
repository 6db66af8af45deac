// SPDX-License-Identifier: Apache-2.0
#include "tests/support/level_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tests/support/random_unit.h"

namespace farfield::test {

namespace {

/// n elements whose bytes count up: every element differs from its neighbours.
template <typename T>
std::vector<T> counted(size_t n, uint8_t first) {
  std::vector<T> values(n);
  auto* bytes = reinterpret_cast<uint8_t*>(values.data());
  for (size_t i = 0; i < n * sizeof(T); ++i) bytes[i] = static_cast<uint8_t>(first + i % 200);
  return values;
}

template <typename T>
std::vector<T> noise(size_t n, Rng& rng) {
  std::vector<T> values(n);
  auto* bytes = reinterpret_cast<uint8_t*>(values.data());
  for (size_t i = 0; i < n * sizeof(T); ++i) bytes[i] = static_cast<uint8_t>(1 + rng.next_uint() % 255);
  return values;
}

/// The densities of one brick, whose first voxel is `corner`. False: it is empty.
bool fill_brick(Brick& brick, const ivec3& corner, const std::function<float(int, int, int)>& density) {
  std::vector<float> values(kBrickVoxels);
  for (int i = 0; i < kBrickVoxels; ++i) {
    values[static_cast<size_t>(i)] = density(corner.x + i % 8, corner.y + i / 8 % 8, corner.z + i / 64);
  }
  const float largest = *std::ranges::max_element(values);
  if (largest <= 0.0f) return false;
  brick.density_scale = largest;
  for (size_t i = 0; i < values.size(); ++i) {
    if (values[i] <= 0.0f) continue;
    brick.density[i] = static_cast<uint8_t>(std::max(1.0f, std::round(values[i] / largest * 255.0f)));
  }
  return true;
}

}  // namespace

LevelData empty_level(uint32_t k, float resolution) {
  LevelData level;
  level.header.level = k;
  level.header.resolution = resolution;
  return level;
}

void set_quads(LevelData& level, std::vector<vec3> positions, const std::vector<Quad>& quads) {
  level.positions = std::move(positions);
  level.positions.reserve(level.positions.size() + 2);
  uint32_t face = 0;
  for (const Quad& quad : quads) {
    level.quad_first_face.push_back(face);
    level.quads.push_back(quad);
    face += quad.is_pair() ? 2 : 1;
  }
  for (const vec3& p : level.positions) level.header.bounds.extend(p);
}

void set_triangles(LevelData& level, std::vector<vec3> positions, const std::vector<Triangle>& triangles) {
  std::vector<Quad> quads;
  for (const Triangle& t : triangles) quads.push_back({t.a, t.b, t.c, t.c});
  set_quads(level, std::move(positions), quads);
}

void set_volume(LevelData& level, const ivec3& dims, const vec3& origin,
                const std::function<float(int, int, int)>& density, const std::function<SymMat3(int, int, int)>& sggx) {
  level.header.brick_dims = dims;
  level.header.volume_origin = origin;
  for (int index = 0; index < dims.x * dims.y * dims.z; ++index) {
    const ivec3 corner = kBrickSide * ivec3(index % dims.x, index / dims.x % dims.y, index / (dims.x * dims.y));
    Brick brick{};
    if (!fill_brick(brick, corner, density)) {
      level.brick_table.push_back(kNoBrick);
      continue;
    }
    for (int i = 0; sggx && i < kBrickVoxels; ++i) {
      if (brick.density[static_cast<size_t>(i)] == 0) continue;
      level.voxel_sggx.push_back(pack_flake_sggx(sggx(corner.x + i % 8, corner.y + i / 8 % 8, corner.z + i / 64)));
    }
    level.brick_table.push_back(static_cast<uint32_t>(level.bricks.size()));
    level.bricks.push_back(brick);
  }
  finish_bricks(level.bricks);
  extend_by_volume(level.header);
}

void finish_bricks(std::vector<Brick>& bricks) {
  uint32_t payload_base = 0;
  for (Brick& brick : bricks) {
    brick.mask = {};
    for (size_t i = 0; i < kBrickVoxels; ++i) {
      if (brick.density[i] != 0) brick.mask[i / 64] |= uint64_t{1} << (i % 64);
    }
    uint16_t voxels = 0;
    for (size_t word = 0; word < 8; ++word) {
      brick.prefix[word] = voxels;
      voxels = static_cast<uint16_t>(voxels + std::popcount(brick.mask[word]));
    }
    brick.payload_base = payload_base;
    payload_base += voxels;
  }
}

void extend_by_volume(LevelHeader& header) {
  header.bounds.extend(header.volume_origin);
  header.bounds.extend(header.volume_origin + header.resolution * vec3(header.brick_dims * kBrickSide));
}

void set_diffuse(LevelData& level, const vec3& albedo) {
  level.face_diffuse.assign(face_count(level), pack_color(albedo));
  level.voxel_diffuse.assign(voxel_count(level), pack_color(albedo));
}

LevelData triangle_soup(uint32_t count, float size, uint64_t seed) {
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

std::vector<LevelData> foliage(uint32_t leaves, uint64_t seed) {
  std::vector<LevelData> levels;
  for (uint32_t k = 0; k < 5; ++k) {
    LevelData level = triangle_soup(leaves >> (2 * k), 0.02f * static_cast<float>(1u << k), seed + k);
    level.header.level = k;
    level.header.resolution = 0.005f * static_cast<float>(1u << k);
    if (k > 0) level.morph_vertex.assign(levels.back().positions.size(), 0);
    if (k > 1) {
      const int bricks = 64 >> k;
      set_volume(level, ivec3(bricks / 2), vec3(-0.3f),
                 [&](int x, int y, int z) { return (x * 7 + y * 3 + z) % 3 == 0 ? 2.0f : 0.0f; });
    }
    set_diffuse(level, vec3(0.5f));
    levels.push_back(std::move(level));
  }
  return levels;
}

LevelData sphere_level(const vec3& center, float radius, uint32_t rings, uint32_t k, float resolution) {
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
  std::vector<Quad> quads;
  for (uint32_t sector = 0; sector < sectors; ++sector) {
    quads.push_back({0, at(1, sector), at(1, sector + 1), at(1, sector + 1)});
    for (uint32_t ring = 1; ring + 1 < rings; ++ring) {
      quads.push_back({at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1), at(ring, sector + 1)});
    }
    quads.push_back({1, at(rings - 1, sector + 1), at(rings - 1, sector), at(rings - 1, sector)});
  }
  set_quads(level, std::move(positions), quads);
  return level;
}

std::vector<LevelData> white_sphere(uint32_t rings) {
  const float r0 = 0.02f;
  const auto ball = [](const ivec3& dims, float voxel) {
    return [=](int x, int y, int z) {
      const vec3 p = (vec3(x, y, z) + 0.5f - 0.5f * vec3(dims * kBrickSide)) * voxel;
      return glm::length(p) < 1.0f ? 10.0f : 0.0f;
    };
  };
  std::vector<LevelData> levels;
  levels.push_back(sphere_level(vec3(0.0f), 1.0f, rings, 0, r0));
  levels.push_back(sphere_level(vec3(0.0f), 1.0f, std::max(rings / 2, 8u), 1, 2 * r0));
  levels.push_back(sphere_level(vec3(0.0f), 0.9f, std::max(rings / 4, 8u), 2, 4 * r0));
  const float voxel2 = 4 * r0;
  set_volume(levels.back(), ivec3(4), vec3(-16 * voxel2),
             [&](int x, int y, int z) { return ball(ivec3(4), voxel2)(x, y, z) > 0.0f ? 0.5f : 0.0f; });
  for (const uint32_t k : {3u, 5u}) {
    LevelData level = empty_level(k, std::ldexp(r0, static_cast<int>(k)));
    const ivec3 dims(k == 3 ? 2 : 1);
    const float voxel = level.header.resolution;
    set_volume(level, dims, vec3(dims * kBrickSide) * (-0.5f * voxel), ball(dims, voxel),
               [](int, int, int) { return SymMat3::identity(); });
    levels.push_back(std::move(level));
  }
  for (LevelData& level : levels) set_diffuse(level, vec3(1.0f));
  return levels;
}

LevelData full_level() {
  LevelData level;
  level.header.level = 3;
  level.header.resolution = 0.25f;
  level.header.brick_dims = {2, 1, 1};
  level.header.volume_origin = {-1.0f, -2.0f, -3.0f};
  extend_by_volume(level.header);

  set_quads(level, {{0.0f, 0.0f, -1.0f}, {1.0f, 0.0f, -1.0f}, {1.0f, -0.5f, -1.5f}, {0.0f, -1.0f, -2.0f}},
            {{0, 1, 2, 3}, {0, 2, 3, 3}});
  level.face_sggx = counted<PackedSurfaceSggx>(3, 1);
  level.face_diffuse = counted<PackedColor>(3, 2);
  level.face_specular = counted<PackedColor>(3, 3);
  level.face_roughness2 = counted<uint8_t>(3, 4);
  level.face_transmission = counted<PackedColor>(3, 5);

  level.brick_table = {0, 1};
  level.bricks.resize(2);
  level.bricks[0].density[0] = 255;
  level.bricks[0].density[70] = 1;
  level.bricks[0].density[511] = 9;
  level.bricks[0].density_scale = 2.5f;
  level.bricks[1].density[63] = 100;
  level.bricks[1].density[64] = 200;
  level.bricks[1].density_scale = 0.125f;
  finish_bricks(level.bricks);
  level.voxel_sggx = counted<PackedFlakeSggx>(5, 6);
  level.voxel_diffuse = counted<PackedColor>(5, 7);
  level.voxel_specular = counted<PackedColor>(5, 8);
  level.voxel_roughness2 = counted<uint8_t>(5, 9);
  level.voxel_transmission = counted<PackedColor>(5, 10);
  level.voxel_self_shadowing = counted<uint8_t>(5, 11);

  level.morph_vertex = {0, 1, 2, 3, 3, kMorphVoxelized};
  level.morph_face = {0, 2, kMorphCollapsed, kMorphVoxelized, 1};
  return level;
}

LevelData full_level_of_version_2() {
  LevelData level = full_level();
  level.face_opacity = counted<uint8_t>(3, 12);
  level.face_emission = counted<PackedRadiance>(3, 13);
  level.voxel_emission = counted<PackedRadiance>(5, 14);
  level.face_material = {0, 7, 2};
  level.source_face = {5 << kSourceTurnBits | 1, 0, 9 << kSourceTurnBits | 2};
  level.corner_vertex = {{0, 1, 2}, {2, 1, 0}, {1, 1, 1}};
  level.shading_normal = counted<PackedNormal>(3, 15);
  level.shading_uv = {{0.0f, 1.0f}, {-2.5f, 0.25f}, {1e6f, NAN}};  // sources say that, too
  level.shading_color = counted<PackedVertexColor>(3, 16);
  return level;
}

LevelData full_level_of_version_3() {
  LevelData level = full_level_of_version_2();
  level.face_gap = counted<uint8_t>(3, 17);
  level.header.hot_spot = 0.15f;
  return level;
}

LevelData full_level_of_version_4() {
  LevelData level = full_level_of_version_3();
  level.voxel_octants = counted<PackedOctants>(5, 18);
  level.header.open_side = {0.1f, -0.2f, 0.3f};
  return level;
}

LevelData full_level_of_version_5() {
  LevelData level = full_level_of_version_4();
  level.header.highlight_lean = -0.25f;
  return level;
}

LevelData full_level_of_version_7() {
  LevelData level = full_level_of_version_4();
  level.face_sheet_shape = {{0, 0, 0}, {255, 128, 7}, {12, 1, 200}};
  return level;
}

LevelData full_level_of_version_8() {
  LevelData level = full_level_of_version_2();
  level.face_sggx.clear();
  level.part_first_quad = {1};
  level.placements = {{mat4x3(1.0f), 0, 0}, {mat4x3(0, -2, 0, 2, 0, 0, 0, 0, 2, 1, -1, 0.5f), 0, 7}};
  return level;
}

LevelData full_level_of_version_6() {
  LevelData level = full_level_of_version_2();
  for (auto* flakes : {&level.voxel_diffuse, &level.voxel_specular, &level.voxel_transmission}) flakes->clear();
  level.voxel_roughness2.clear();
  level.voxel_emission.clear();
  level.voxel_albedo = counted<PackedAlbedo>(5, 19);
  level.voxel_anisotropy = {-124, -1, 0, 1, 124};
  level.header.medium = Medium::Fog;
  level.header.fog_albedo = {0.25f, 0.5f, 1.0f};
  level.header.fog_anisotropy = -0.75f;
  return level;
}

LevelData random_level(uint64_t seed, uint32_t quads, uint32_t bricks) {
  Rng rng(seed);
  LevelData level;
  level.header.level = rng.next_uint() % 10;
  level.header.resolution = 0.001f + rng.next();
  level.header.volume_origin = {10 * rng.next(), -10 * rng.next(), 5.0f};
  const auto has = [&] { return rng.next_uint() % 2 == 0; };

  if (bricks > 0) {
    level.header.brick_dims = {static_cast<int>(bricks), 2, 1};  // half of the table is empty
    level.brick_table.assign(2 * size_t{bricks}, kNoBrick);
    level.bricks.resize(bricks);
    for (uint32_t i = 0; i < bricks; ++i) {
      level.brick_table[2 * i + rng.next_uint() % 2] = i;
      for (uint8_t& density : level.bricks[i].density) {
        density = has() ? static_cast<uint8_t>(rng.next_uint() % 256) : uint8_t{0};
      }
      level.bricks[i].density_scale = 0.01f + rng.next();
    }
    finish_bricks(level.bricks);
    const uint32_t voxels = voxel_count(level);
    if (has()) level.voxel_sggx = noise<PackedFlakeSggx>(voxels, rng);
    if (has()) level.voxel_diffuse = noise<PackedColor>(voxels, rng);
    if (has()) {
      level.voxel_specular = noise<PackedColor>(voxels, rng);
      level.voxel_roughness2 = noise<uint8_t>(voxels, rng);
    }
    if (has()) level.voxel_transmission = noise<PackedColor>(voxels, rng);
    if (has()) level.voxel_self_shadowing = noise<uint8_t>(voxels, rng);
  }
  extend_by_volume(level.header);

  if (quads > 0) {
    const uint32_t vertices = quads + 3;
    std::vector<vec3> positions;
    for (uint32_t i = 0; i < vertices; ++i) positions.emplace_back(rng.next(), rng.next(), rng.next());
    std::vector<Quad> list;
    for (uint32_t i = 0; i < quads; ++i) {
      const uint32_t v2 = rng.next_uint() % vertices;
      list.push_back({rng.next_uint() % vertices, rng.next_uint() % vertices, v2, has() ? v2 : (v2 + 1) % vertices});
    }
    set_quads(level, std::move(positions), list);
    const uint32_t face = face_count(level);
    if (has()) level.face_sggx = noise<PackedSurfaceSggx>(face, rng);
    if (has()) level.face_diffuse = noise<PackedColor>(face, rng);
    if (has()) {
      level.face_specular = noise<PackedColor>(face, rng);
      level.face_roughness2 = noise<uint8_t>(face, rng);
    }
    if (has()) level.face_transmission = noise<PackedColor>(face, rng);
    for (uint32_t i = 0; i < 2 * quads; ++i) {
      level.morph_vertex.push_back(i % 5 == 0 ? kMorphVoxelized : rng.next_uint() % vertices);
      level.morph_face.push_back(i % 5 == 0 ? kMorphCollapsed : rng.next_uint() % face);
    }
  }
  if (bricks > 0 && has()) level.header.hot_spot = 0.5f * rng.next();
  if (bricks > 0 && has()) level.header.highlight_lean = rng.next() - 0.5f;
  if (has()) level.voxel_octants = noise<PackedOctants>(voxel_count(level), rng);
  return level;
}

}  // namespace farfield::test
