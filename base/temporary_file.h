// SPDX-License-Identifier: Apache-2.0
// Files that appear whole or not at all, and folders that disappear.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <span>

#include "base/file_io.h"
#include "base/result.h"

namespace farfield {

/// A new file beside `target`; commit() renames it to the target, otherwise the destructor removes it. Keeps the first
/// error until commit(), since image libraries that write through this lose some, above all those of the last bytes.
/// Two writers of one target do not disturb each other: the last rename wins. One thread at a time.
class TemporaryFile {
 public:
  /// expected_bytes: what will be written, for the message when the disk is full; 0: unknown.
  explicit TemporaryFile(std::filesystem::path target, uint64_t expected_bytes = 0);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// False if this or anything before it failed.
  bool write(std::span<const std::byte> bytes);
  bool seek(uint64_t position);
  uint64_t position() const;
  /// Whether the file could be created and all went well since.
  bool is_good() const { return error_ == 0; }
  /// Syncs the file, renames it, syncs the folder. After an error nothing of it is left and what was at the target
  /// before is untouched, unless the disk fails when the folder is synced: then the new file is there, and the error
  /// says so. Errors: Io, also for what failed before, naming the target, the system's words, a remedy.
  Result<void> commit();

 private:
  bool note(bool succeeded);

  const std::filesystem::path target_;
  const uint64_t expected_bytes_;
  const FileDescriptor folder_;  ///< opened before anything is written, so that only the disk can fail the last step
  std::filesystem::path path_;   ///< empty once renamed
  std::FILE* file_ = nullptr;
  int error_ = 0;  ///< errno of the first failure
};

/// A new folder in the system's temporary place, gone with all in it when this is.
class TemporaryFolder {
 public:
  /// Errors: Io.
  static Result<TemporaryFolder> create();
  ~TemporaryFolder();
  TemporaryFolder(TemporaryFolder&& other) noexcept;
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  explicit TemporaryFolder(std::filesystem::path path);

  std::filesystem::path path_;
};

}  // namespace farfield
