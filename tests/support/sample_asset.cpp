// SPDX-License-Identifier: Apache-2.0
#include "tests/support/sample_asset.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <fstream>

#include "base/hash.h"
#include "base/random.h"
#include "cache/level_file.h"
#include "cache/level_format.h"

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

void fill_box_bounds(LevelHeader& header) {
  header.bounds.extend(header.volume_origin);
  header.bounds.extend(header.volume_origin +
                       vec3(header.brick_dims) * static_cast<float>(kBrickSide) * header.resolution);
}

}  // namespace

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

LevelData full_level() {
  LevelData level;
  level.header.level = 3;
  level.header.resolution = 0.25f;
  level.header.brick_dims = {2, 1, 1};
  level.header.volume_origin = {-1.0f, -2.0f, -3.0f};
  fill_box_bounds(level.header);

  level.positions = {{0.0f, 0.0f, -1.0f}, {1.0f, 0.0f, -1.0f}, {1.0f, -0.5f, -1.5f}, {0.0f, -1.0f, -2.0f}};
  level.quads = {{0, 1, 2, 3}, {0, 2, 3, 3}};
  level.quad_first_face = {0, 2};
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
  fill_box_bounds(level.header);

  if (quads > 0) {
    const uint32_t vertices = quads + 3;
    for (uint32_t i = 0; i < vertices; ++i) {
      level.positions.emplace_back(rng.next(), rng.next(), rng.next());
      level.header.bounds.extend(level.positions.back());
    }
    uint32_t face = 0;
    for (uint32_t i = 0; i < quads; ++i) {
      const uint32_t v2 = rng.next_uint() % vertices;
      level.quads.push_back(
          {rng.next_uint() % vertices, rng.next_uint() % vertices, v2, has() ? v2 : (v2 + 1) % vertices});
      level.quad_first_face.push_back(face);
      face += level.quads.back().is_pair() ? 2 : 1;
    }
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
  return level;
}

FileImage::FileImage(const LevelView& level) {
  const LevelLayout layout = layout_of(level);
  const std::vector<std::byte> head = encode_head(level, layout);
  storage_.resize(layout.file_bytes / sizeof(Line));
  size_ = layout.file_bytes;
  std::memcpy(storage_.data(), head.data(), head.size());
  size_t next = 0;
  for_each_section(level, [&](SectionId, const auto& array) {
    if (array.empty()) return;
    std::memcpy(bytes().data() + layout.sections[next].offset, array.data(), array.size_bytes());
    ++next;
  });
}

FileImage::FileImage(std::span<const std::byte> bytes) : storage_((bytes.size() + 63) / 64), size_(bytes.size()) {
  if (size_ > 0) std::memcpy(storage_.data(), bytes.data(), size_);
}

uint64_t walk(const LevelView& level) {
  uint64_t digest = 0;
  const auto see = [&](const auto& value) { digest = mix64(digest, hash_values(std::span(&value, 1))); };
  const auto see_payload = [&](size_t i, const auto&... arrays) {
    const auto see_one = [&](const auto& array) {
      if (!array.empty()) see(array.data()[i]);
    };
    (see_one(arrays), ...);
  };
  for (size_t q = 0; q < level.quads.size(); ++q) {
    const Quad quad = level.quads[q];
    for (const uint32_t v : {quad.v0, quad.v1, quad.v2, quad.v3}) see(level.positions.data()[v]);
    for (uint32_t side = 0; side < (quad.is_pair() ? 2u : 1u); ++side) {
      see_payload(level.quad_first_face.data()[q] + side, level.face_sggx, level.face_diffuse, level.face_specular,
                  level.face_roughness2, level.face_transmission);
    }
  }
  const ivec3 dims = level.header.brick_dims;
  for (int cell = 0; cell < dims.x * dims.y * dims.z; ++cell) {
    const uint32_t index = level.brick_table.data()[cell];
    if (index == kNoBrick) continue;
    const Brick& brick = level.bricks.data()[index];
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (brick.density[static_cast<size_t>(i)] == 0) continue;
      see_payload(brick.payload_index(i), level.voxel_sggx, level.voxel_diffuse, level.voxel_specular,
                  level.voxel_roughness2, level.voxel_transmission, level.voxel_self_shadowing);
    }
  }
  for (const uint32_t vertex : level.morph_vertex) {
    if (vertex != kMorphVoxelized) see(level.positions.data()[vertex]);
  }
  for (const uint32_t face : level.morph_face) {
    if (face != kMorphVoxelized && face != kMorphCollapsed) see_payload(face, level.face_sggx, level.face_diffuse);
  }
  // What Embree reads beyond the last position.
  if (!level.positions.empty()) {
    std::array<std::byte, 16> padding;
    std::memcpy(padding.data(), level.positions.data() + level.positions.size(), padding.size());
    see(padding);
  }
  return digest;
}

Manifest sample_manifest() {
  Manifest manifest;
  manifest.generator = "farfield 0.1.0";
  manifest.source = "oak.glb";
  manifest.source_hash = 0x0123456789abcdefull;
  manifest.options = "finest_grid=512";
  manifest.origin = {1e7, -2.5, 0.1};
  manifest.bounds = {vec3(-1.0f, -2.0f, -3.0f), vec3(0.1f, 0.2f, 0.3f)};
  manifest.base_resolution = 0.125;
  manifest.hull = {{-1.0f, -2.0f, -3.0f}, {0.1f, 0.2f, 0.3f}};
  for (const uint32_t k : {0u, 1u, 3u}) {
    LevelEntry level;
    level.level = k;
    level.resolution = 0.125 * (1 << k);
    level.grid = 32u >> k;
    level.file = "level_" + std::to_string(k) + ".ffl";
    level.file_bytes = 1000 + k;
    level.file_hash = mix64(k);
    level.triangles = 100 - k;
    level.voxels = 10 * k;
    level.bricks = k;
    level.resident_bytes = 4096 * (4 - k);
    level.build_peak_bytes = 100 * (4 - k);
    if (k == 1) level.errors = LevelErrors{-0.01, 0.02, 0.03};
    manifest.levels.push_back(level);
  }
  return manifest;
}

Manifest write_sample_asset(const std::filesystem::path& folder) {
  Manifest manifest = sample_manifest();
  manifest.bounds = Box3{};
  manifest.hull.clear();
  LevelData finer;
  for (LevelEntry& entry : manifest.levels) {
    LevelData level = random_level(entry.level + 1, 50u >> entry.level, entry.level);
    level.header.level = entry.level;
    level.header.resolution = static_cast<float>(entry.resolution);
    level.header.bounds = Box3{};
    level.header.volume_origin = vec3(0.0f);
    fill_box_bounds(level.header);
    for (const vec3& position : level.positions) level.header.bounds.extend(position);
    level.morph_vertex.assign(finer.positions.size(), 0);
    level.morph_face.assign(face_count(view_of(finer)), kMorphCollapsed);
    manifest.bounds.extend(level.header.bounds);

    const auto path = folder / entry.file;
    entry.file_bytes = *write_level(path, level);
    entry.file_hash = hash_bytes(read_bytes(path));
    entry.triangles = face_count(view_of(level));
    entry.voxels = voxel_count(view_of(level));
    entry.bricks = level.bricks.size();
    entry.resident_bytes = entry.file_bytes + 1000;
    finer = std::move(level);
  }
  const vec3 corners[] = {manifest.bounds.lower, manifest.bounds.upper};
  for (size_t i = 0; i < 8; ++i) {
    manifest.hull.emplace_back(corners[i & 1].x, corners[i >> 1 & 1].y, corners[i >> 2].z);
  }
  const Result<void> written = write_manifest(folder, manifest);
  if (!written) std::abort();
  return manifest;
}

TemporaryFolder::TemporaryFolder() {
  static std::atomic<int> counter{0};
  path_ = std::filesystem::temp_directory_path() /
          ("farfield_test_" + std::to_string(::getpid()) + "_" + std::to_string(counter.fetch_add(1)));
  std::filesystem::create_directories(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::vector<std::string> TemporaryFolder::names() const {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(path_)) names.push_back(entry.path().filename());
  std::ranges::sort(names);
  return names;
}

std::vector<std::byte> read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

void write_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void write_text(const std::filesystem::path& path, std::string_view text) {
  write_bytes(path, std::as_bytes(std::span(text)));
}

}  // namespace farfield::test
