// SPDX-License-Identifier: Apache-2.0
// Files that appear whole or not at all, and folders that disappear.
#pragma once

#include <filesystem>

#include "base/result.h"

namespace farfield {

/// A name beside `target` to write to; commit() renames it to the target, otherwise the destructor removes it.
class TemporaryFile {
 public:
  explicit TemporaryFile(std::filesystem::path target);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Errors: Io.
  Result<void> commit();

 private:
  std::filesystem::path target_;
  std::filesystem::path path_;
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
