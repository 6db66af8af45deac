// SPDX-License-Identifier: Apache-2.0
// Level files: one level, sections 64-byte aligned, usable in place from a read-only map. Layout: docs/file_format.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "base/result.h"
#include "cache/level.h"

namespace farfield {

/// Writes `level` to `path`: to a temporary name beside it, synced, then renamed, so that the file is whole or absent.
/// The bytes depend only on the level. Returns the file's size. Errors: Io (naming the path and the system's words).
Result<uint64_t> write_level(const std::filesystem::path& path, const LevelData& level);

/// How much of a level file open() proves before it trusts it.
enum class LevelCheck {
  Structure,  ///< header, section table, sizes, brick and quad indices: enough that no read leaves the file
  Full,       ///< and every section's checksum and the values (finite positions, densities, monotone prefixes)
};

/// A level file mapped read-only. Immutable; any thread may read it. The file must not be changed while mapped.
class LevelFile {
 public:
  /// Maps and checks a level file. Errors: NotFound, Io, BadFile (with offset and what was expected).
  static Result<std::unique_ptr<LevelFile>> open(const std::filesystem::path& path, LevelCheck check);
  ~LevelFile();
  LevelFile(const LevelFile&) = delete;
  LevelFile& operator=(const LevelFile&) = delete;

  const LevelView& view() const { return view_; }
  uint64_t file_bytes() const { return map_bytes_; }
  /// Bytes of the sections that only a BVH build reads (positions, quads): see release_build_pages().
  uint64_t build_only_bytes() const;
  /// Gives the pages of positions and quads back to the system; they return from disk if touched again.
  void release_build_pages() const;

 private:
  LevelFile() = default;
  const std::byte* map_ = nullptr;
  uint64_t map_bytes_ = 0;
  LevelView view_;
};

}  // namespace farfield
