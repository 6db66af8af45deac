// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/temporary_file.h"

#include <fmt/format.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

namespace farfield {

TemporaryFile::TemporaryFile(std::filesystem::path target) : target_(std::move(target)) {
  // The process id keeps two runs apart. What a killed run with the same id left is overwritten.
  path_ = target_.parent_path() /
          fmt::format(".{}.{}.tmp{}", target_.stem().string(), getpid(), target_.extension().string());
  file_ = std::fopen(path_.c_str(), "wbe");
  note(file_ != nullptr);
}

TemporaryFile::~TemporaryFile() {
  std::error_code ignored;
  if (file_) std::fclose(file_);
  if (!path_.empty()) std::filesystem::remove(path_, ignored);
}

bool TemporaryFile::note(bool succeeded) {
  if (!succeeded && error_ == 0) error_ = errno != 0 ? errno : EIO;
  return is_good();
}

bool TemporaryFile::write(const void* data, size_t bytes) {
  return is_good() && note(std::fwrite(data, 1, bytes, file_) == bytes);
}

bool TemporaryFile::seek(uint64_t position) {
  return is_good() && note(fseeko(file_, static_cast<off_t>(position), SEEK_SET) == 0);
}

uint64_t TemporaryFile::position() const { return file_ ? static_cast<uint64_t>(ftello(file_)) : 0; }

Result<void> TemporaryFile::commit() {
  // A full disk shows when the buffer is written, with late allocation when it is synced, on NFS when it is closed.
  if (is_good()) note(std::fflush(file_) == 0);
  if (is_good()) note(fsync(fileno(file_)) == 0);
  if (file_) note(std::fclose(std::exchange(file_, nullptr)) == 0);
  if (is_good()) note(::rename(path_.c_str(), target_.c_str()) == 0);
  if (!is_good()) {
    return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}; check the folder's free space and permissions",
                                                 target_.string(), std::strerror(error_)));
  }
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
