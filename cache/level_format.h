// SPDX-License-Identifier: Apache-2.0
// The bytes of a level file (docs/file_format.md): what is where, and how a view of it is made.
//
//   0           FileHeader, 128 bytes
//   128         SectionEntry[section_count], 40 bytes each, ascending ids
//   64-aligned  first section, zeros up to the next multiple of 64, second section, ...
//
// The layout has no freedom: the lengths of the arrays decide every offset. So the bytes depend only on the level, and
// a reader can tell each offset that is wrong.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "cache/level.h"

namespace farfield {

enum class LevelCheck;  // cache/level_file.h

static_assert(std::endian::native == std::endian::little, "level files are little-endian and are used in place");

/// 1 had arrays 1 to 18 alone, 2 those to 27 and no hot spot, 3 those to 28 and no open side, 5 those to 29 and no fog,
/// 6 those to 31, 7 those to 32.
inline constexpr uint32_t kLevelFileVersion = 8;
/// Not text (first byte), and a copy in text mode breaks it (line ends), as in PNG.
inline constexpr std::array<uint8_t, 8> kLevelFileMagic = {0x89, 'F', 'F', 'L', 'V', '\r', '\n', 0x1a};
inline constexpr uint64_t kSectionAlignment = 64;  ///< a cache line; Brick needs it
inline constexpr uint64_t kPositionsPadding = 16;  ///< Embree reads 16 bytes at the last position
inline constexpr uint64_t kPageBytes = 4096;       ///< the granularity in which memory becomes resident

inline uint64_t round_up(uint64_t value, uint64_t multiple_of) {
  return (value + multiple_of - 1) / multiple_of * multiple_of;
}

/// What a section holds; see FARFIELD_LEVEL_ARRAYS.
enum class SectionId : uint32_t {
#define FARFIELD_ID(id, Name, field, Element, Group) Name = id,
  FARFIELD_LEVEL_ARRAYS(FARFIELD_ID)
#undef FARFIELD_ID
};
/// "positions", "quads", ... as the fields of LevelArrays are called.
std::string_view section_name(SectionId id);

/// Which arrays have the same length.
enum class SectionGroup {
  Vertices,
  Quads,
  Faces,
  BrickTable,
  Bricks,
  Voxels,
  MorphVertices,
  MorphFaces,
  ShadingVertices,
  Parts,
  Placements
};

/// Calls visit(id, group, array) for every array of a level, in file order. Level: LevelData or LevelView, const or
/// not.
template <typename Level, typename Visit>
void for_each_grouped_section(Level& level, Visit&& visit) {
#define FARFIELD_VISIT(id, Name, field, Element, Group) visit(SectionId::Name, SectionGroup::Group, level.field);
  FARFIELD_LEVEL_ARRAYS(FARFIELD_VISIT)
#undef FARFIELD_VISIT
}

/// The same with visit(id, array).
template <typename Level, typename Visit>
void for_each_section(Level& level, Visit&& visit) {
  for_each_grouped_section(level, [&](SectionId id, SectionGroup, auto& array) { visit(id, array); });
}

struct FileHeader {
  std::array<uint8_t, 8> magic;
  uint32_t version;
  uint32_t section_count;
  uint64_t file_bytes;  ///< size of the whole file
  uint64_t head_hash;   ///< XXH3 of the section table, seeded with the XXH3 of this header while head_hash is 0
  uint32_t level;
  float resolution;
  std::array<float, 3> bounds_lower;
  std::array<float, 3> bounds_upper;
  std::array<int32_t, 3> brick_dims;
  std::array<float, 3> volume_origin;
  float hot_spot;
  std::array<float, 3> open_side;
  float highlight_lean;
  uint32_t medium;
  std::array<float, 3> fog_albedo;
  float fog_anisotropy;
};
static_assert(sizeof(FileHeader) == 128 && offsetof(FileHeader, level) == 32 && offsetof(FileHeader, medium) == 108);

struct SectionEntry {
  uint32_t id;             ///< SectionId
  uint32_t element_bytes;  ///< size of one element
  uint64_t count;          ///< > 0: empty arrays have no entry
  uint64_t offset;         ///< from the start of the file
  uint64_t bytes;          ///< count * element_bytes
  uint64_t hash;           ///< XXH3 of those bytes
};
static_assert(sizeof(SectionEntry) == 40);

static_assert(sizeof(vec3) == 12 && sizeof(uvec3) == 12 && sizeof(vec2) == 8 && sizeof(PackedColor) == 3 &&
              offsetof(Brick, prefix) == 64 && offsetof(Brick, density_scale) == 80 &&
              offsetof(Brick, payload_base) == 84 && offsetof(Brick, density) == 128);

/// Where each array of a level lies in its file. Hashes are 0.
struct LevelLayout {
  std::vector<SectionEntry> sections;
  uint64_t file_bytes = 0;
};
LevelLayout layout_of(const LevelView& level);

/// Header and section table of a level's file, hashes included.
std::vector<std::byte> encode_head(const LevelView& level, const LevelLayout& layout);

/// Writes the hash of a file's header and table into its header; for tests and fuzzers that change either.
/// Does nothing to bytes that are too few.
void seal_head(std::span<std::byte> file);

/// The view of a level file that lies in memory. bytes: 64-byte aligned; the view is valid while they are. name: of the
/// file, for messages. Errors: BadFile (with the byte offset or the element), Unsupported (newer version).
Result<LevelView> parse_level(std::span<const std::byte> bytes, LevelCheck check, std::string_view name);

}  // namespace farfield
