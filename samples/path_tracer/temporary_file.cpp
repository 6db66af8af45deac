// SPDX-License-Identifier: Apache-2.0
#include "samples/path_tracer/temporary_file.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

namespace farfield {

TemporaryFile::TemporaryFile(std::filesystem::path target) : target_(std::move(target)) {
  // The process id keeps two runs apart; the extension stays, because image libraries choose the format by it.
  path_ = target_.parent_path() /
          fmt::format(".{}.{}.tmp{}", target_.stem().string(), getpid(), target_.extension().string());
}

TemporaryFile::~TemporaryFile() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove(path_, ignored);
}

Result<void> TemporaryFile::commit() {
  std::error_code error;
  std::filesystem::rename(path_, target_, error);
  if (error) return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}", target_.string(), error.message()));
  path_.clear();
  return {};
}

Result<TemporaryFolder> TemporaryFolder::create() {
  std::error_code error;
  std::string name = (std::filesystem::temp_directory_path(error) / "farfield-XXXXXX").string();
  if (error || !mkdtemp(name.data())) {
    return make_error(ErrorCode::Io, fmt::format("cannot make a folder {}: {}; set TMPDIR to a place that has room",
                                                 name, error ? error.message() : std::strerror(errno)));
  }
  return TemporaryFolder(name);
}

TemporaryFolder::TemporaryFolder(std::filesystem::path path) : path_(std::move(path)) {}

TemporaryFolder::TemporaryFolder(TemporaryFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

}  // namespace farfield
