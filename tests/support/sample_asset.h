// SPDX-License-Identifier: Apache-2.0
// Small levels and folders for the tests and fuzzers of this room.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cache/level.h"
#include "cache/manifest.h"

namespace farfield::test {

/// A level with every section: two quads (a pair and a lone triangle) and two bricks of a 2x1x1 table.
LevelData full_level();
/// A random sound level: `quads` quads, `bricks` bricks, channels picked by the seed.
LevelData random_level(uint64_t seed, uint32_t quads, uint32_t bricks);
/// Fills mask, prefix and payload_base from the densities of all bricks, in order.
void finish_bricks(std::vector<Brick>& bricks);

/// The bytes of a level's file, 64-byte aligned. Unlike write_level() this takes any level, sound or not.
class FileImage {
 public:
  explicit FileImage(const LevelView& level);
  explicit FileImage(std::span<const std::byte> bytes);
  std::span<std::byte> bytes() { return {reinterpret_cast<std::byte*>(storage_.data()), size_}; }

 private:
  struct alignas(64) Line {
    std::byte bytes[64];
  };
  std::vector<Line> storage_;
  size_t size_ = 0;
};

/// Reads everything a ray or a build may read of a level, through its indices, as the bricks' and quads' documentation
/// allows. Returns a digest. Under ASan this fails if a view leads out of its file.
uint64_t walk(const LevelView& level);

/// A manifest of three levels (0, 1 and 3).
Manifest sample_manifest();

/// Writes a sound asset of three levels (0, 1 and 3) with surfaces, volumes and morph maps. Returns its manifest.
Manifest write_sample_asset(const std::filesystem::path& folder);

/// A folder under the system's temporary one, removed with all that is in it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  const std::filesystem::path& path() const { return path_; }
  std::vector<std::string> names() const;  ///< of what is inside, sorted

 private:
  std::filesystem::path path_;
};

std::vector<std::byte> read_bytes(const std::filesystem::path& path);
void write_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_text(const std::filesystem::path& path, std::string_view text);

}  // namespace farfield::test
