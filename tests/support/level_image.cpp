// SPDX-License-Identifier: Apache-2.0
#include "tests/support/level_image.h"

#include <array>
#include <cstring>

#include "base/hash.h"
#include "cache/level_format.h"

namespace farfield::test {

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

}  // namespace farfield::test
