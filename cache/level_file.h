// SPDX-License-Identifier: Apache-2.0
// Level files: one level, sections 64-byte aligned, usable in place from a read-only map. Layout: docs/file_format.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "base/result.h"
#include "cache/level.h"

namespace farfield {

/// Writes `level` to `path`: to a temporary name beside it, synced, then renamed, so that the file is whole or absent.
/// The bytes depend only on the level. Returns the file's size. Errors: Io (naming the path and the system's words),
/// InvalidArgument (a level that open() would refuse).
Result<uint64_t> write_level(const std::filesystem::path& path, const LevelData& level);

/// What a level takes on disk and in memory, exact, before it is written.
struct LevelFileSizes {
  uint64_t file_bytes = 0;
  uint64_t mapped_bytes = 0;      ///< file_bytes rounded up to pages: resident once every byte was touched
  uint64_t build_only_bytes = 0;  ///< of those, what LevelFile::release_build_pages() gives back
};
LevelFileSizes level_file_sizes(const LevelView& level);

/// How much of a level file open() proves before it trusts it.
enum class LevelCheck {
  Structure,  ///< header, section table, sizes, brick and quad indices: enough that no read leaves the file
  Values,     ///< and the values (finite positions, densities, monotone prefixes): for bytes whose hash is known
  Full,       ///< and every section's checksum
};

/// A level file mapped read-only. Immutable; any thread may read it. The file must not be changed while mapped.
class LevelFile {
 public:
  /// Maps and checks a level file. Errors: NotFound, Io, BadFile (with offset and what was expected).
  static Result<std::unique_ptr<LevelFile>> open(const std::filesystem::path& path, LevelCheck check);
  /// Maps and checks the file that a manifest means. All its bytes are read for their hash, once: that stands for the
  /// sections' checksums. Errors: those of open(); BadFile if it is another file.
  static Result<std::unique_ptr<LevelFile>> open_known(const std::filesystem::path& path, uint64_t file_hash);
  ~LevelFile();
  LevelFile(const LevelFile&) = delete;
  LevelFile& operator=(const LevelFile&) = delete;

  const LevelView& view() const { return view_; }
  uint64_t file_bytes() const { return map_bytes_; }
  /// The whole file, for hashing.
  std::span<const std::byte> bytes() const { return {map_, map_bytes_}; }
  /// Bytes of the whole pages that hold only morph maps, which rays that dissolve between levels do not read, and
  /// positions and quads, unless faces have texture coordinates: then hits read them, else only a BVH build does.
  uint64_t build_only_bytes() const;
  /// Gives those pages back to the system; they return from disk if touched again. Any thread.
  void release_build_pages() const;

 private:
  LevelFile() = default;
  static Result<std::unique_ptr<LevelFile>> map(const std::filesystem::path& path);
  const std::byte* map_ = nullptr;  ///< file_bytes() long; owned
  uint64_t map_bytes_ = 0;
  LevelView view_;
};

/// The hash that a manifest records of a level file: of all its bytes. Errors: those of LevelFile::open.
Result<uint64_t> hash_level_file(const std::filesystem::path& path);

}  // namespace farfield
