// SPDX-License-Identifier: Apache-2.0
// Files that appear whole or not at all, and folders that disappear.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>

#include "base/result.h"

namespace farfield {

/// A new file beside `target`; commit() renames it to the target, otherwise the destructor removes it. Image libraries
/// lose some errors of writing, above all those of the last bytes, so they write through this, which keeps the first
/// error until commit(). One thread at a time.
class TemporaryFile {
 public:
  explicit TemporaryFile(std::filesystem::path target);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// False if this or anything before it failed.
  bool write(const void* data, size_t bytes);
  bool seek(uint64_t position);
  uint64_t position() const;
  /// Whether the file could be created and all went well since.
  bool is_good() const { return error_ == 0; }
  /// Makes the file durable and renames it. Errors: Io, also for what failed before.
  Result<void> commit();

 private:
  bool note(bool succeeded);

  std::filesystem::path target_;
  std::filesystem::path path_;
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
