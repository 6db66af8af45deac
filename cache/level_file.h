// SPDX-License-Identifier: Apache-2.0
// Level files: one level, sections 64-byte aligned, used in place once read. Layout: docs/file_format.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include "base/result.h"
#include "cache/level.h"

namespace farfield {

/// Writes `level` to `path`: to a temporary name beside it, synced, then renamed, so that the file is whole or absent.
/// The bytes depend only on the level. Returns the file's size. Errors: Io (naming the path and the system's words),
/// InvalidArgument (a level that open() would refuse).
Result<uint64_t> write_level(const std::filesystem::path& path, const LevelView& level);
inline Result<uint64_t> write_level(const std::filesystem::path& path, const LevelData& level) {
  return write_level(path, view_of(level));
}

/// What a level takes on disk and in memory, exact, before it is written.
struct LevelFileSizes {
  uint64_t file_bytes = 0;
  uint64_t memory_bytes = 0;      ///< file_bytes rounded up to pages: what a LevelFile takes
  uint64_t build_only_bytes = 0;  ///< of those, what LevelFile::release_build_pages() gives back
};
LevelFileSizes level_file_sizes(const LevelView& level);

/// How much of a level file open() proves before it trusts it.
enum class LevelCheck {
  Structure,  ///< header, section table, sizes, brick and quad indices: enough that no read leaves the file
  Values,     ///< and the values (finite positions, densities, monotone prefixes): for bytes whose hash is known
  Full,       ///< and every section's checksum
};

/// A level file in memory. What was checked is what rays read, whatever happens to the file afterwards: the bytes are a
/// copy (docs/decisions/0027-levels-are-copied.md), read-only once checked. Immutable; any thread may read it.
class LevelFile {
 public:
  /// Reads and checks a level file. Errors: NotFound, Io (also if the file becomes shorter meanwhile), BadFile (with
  /// offset and what was expected).
  static Result<std::unique_ptr<LevelFile>> open(const std::filesystem::path& path, LevelCheck check);
  /// Reads and checks the file that a manifest means, by its size and by the hash of all its bytes, which stands for
  /// the sections' checksums. A file of another size takes no memory. Errors: those of open(); BadFile if it is another
  /// file.
  static Result<std::unique_ptr<LevelFile>> open_known(const std::filesystem::path& path, uint64_t file_bytes,
                                                       uint64_t file_hash);
  ~LevelFile();
  LevelFile(const LevelFile&) = delete;
  LevelFile& operator=(const LevelFile&) = delete;

  const LevelView& view() const { return view_; }
  uint64_t file_bytes() const { return file_bytes_; }
  /// The whole file, for hashing.
  std::span<const std::byte> bytes() const { return {bytes_, file_bytes_}; }
  /// Bytes of the whole pages that hold only morph maps, which rays that dissolve between levels do not read, and
  /// positions and quads, unless faces have texture coordinates: then hits read them, else only a BVH build does.
  uint64_t build_only_bytes() const;
  /// Gives those pages back to the system for good: what they held reads as zeros from then on. One thread.
  void release_build_pages();

 private:
  LevelFile() = default;
  static Result<std::unique_ptr<LevelFile>> read(const std::filesystem::path& path,
                                                 std::optional<uint64_t> expected_bytes = {});
  Result<void> parse(LevelCheck check, const std::filesystem::path& path);
  std::byte* bytes_ = nullptr;  ///< file_bytes() of whole pages; owned
  uint64_t file_bytes_ = 0;
  LevelView view_;
};

}  // namespace farfield
