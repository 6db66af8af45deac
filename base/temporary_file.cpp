// SPDX-License-Identifier: Apache-2.0
#include "base/temporary_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "base/bytes.h"

namespace farfield {

namespace fs = std::filesystem;

namespace {

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

fs::path temporary_name(const fs::path& target) {
  static std::atomic<uint64_t> counter{0};  // relaxed: only uniqueness matters
  fs::path name = target;
  name += fmt::format(".tmp-{}-{}", ::getpid(), counter.fetch_add(1, std::memory_order_relaxed));
  return name;
}

std::string needs(uint64_t bytes) { return bytes == 0 ? "" : fmt::format("it needs {}: ", format_bytes(bytes)); }

/// What the user can do about a failed write.
std::string write_remedy(int error, const fs::path& path, uint64_t bytes) {
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return needs(bytes) + "free some space or choose another folder";
    case EACCES:
    case EPERM:
    case EROFS:
      return fmt::format("check the permissions of {} or choose another folder", folder_of(path).string());
    case ENOENT:
    case ENOTDIR:
      return fmt::format("create the folder {} first", folder_of(path).string());
    case EISDIR:
      return "a folder has this name: remove it or choose another";
    case EEXIST:
      return "it is no file: choose another name";
    case EFBIG:
      return needs(bytes) + "raise the file size limit (ulimit -f)";
    case EMFILE:
    case ENFILE:
      return "raise the limit of open files (ulimit -n)";
    default:
      return "check the disk";
  }
}

/// Whether a rename over the path would lose something else than a file: a device, a pipe, a folder.
bool is_other_than_file(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_symlink(status);
}

}  // namespace

TemporaryFile::TemporaryFile(fs::path target, uint64_t expected_bytes)
    : target_(std::move(target)),
      expected_bytes_(expected_bytes),
      folder_(::open(folder_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (!note(folder_.get() >= 0)) return;
  if (is_other_than_file(target_)) {
    error_ = fs::is_directory(target_) ? EISDIR : EEXIST;
    return;
  }
  int fd = -1;
  do {  // in a container each run has the same process id, and a killed one leaves its files
    path_ = temporary_name(target_);
    fd = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  } while (fd < 0 && errno == EEXIST);
  if (!note(fd >= 0)) {
    path_.clear();
    return;
  }
  file_ = ::fdopen(fd, "wb");
  if (!note(file_ != nullptr)) ::close(fd);
}

TemporaryFile::~TemporaryFile() {
  if (file_) std::fclose(file_);
  if (!path_.empty()) ::unlink(path_.c_str());
}

bool TemporaryFile::note(bool succeeded) {
  if (!succeeded && error_ == 0) error_ = errno != 0 ? errno : EIO;
  return is_good();
}

bool TemporaryFile::write(std::span<const std::byte> bytes) {
  return is_good() && note(std::fwrite(bytes.data(), 1, bytes.size(), file_) == bytes.size());
}

bool TemporaryFile::seek(uint64_t position) {
  return is_good() && note(fseeko(file_, static_cast<off_t>(position), SEEK_SET) == 0);
}

uint64_t TemporaryFile::position() const { return file_ ? static_cast<uint64_t>(ftello(file_)) : 0; }

Result<void> TemporaryFile::commit() {
  // A full disk shows when the buffer is written, with late allocation when it is synced, on NFS when it is closed.
  if (is_good()) note(std::fflush(file_) == 0);
  if (is_good()) note(::fsync(fileno(file_)) == 0);
  if (file_) note(std::fclose(std::exchange(file_, nullptr)) == 0);
  if (is_good()) note(::rename(path_.c_str(), target_.c_str()) == 0);
  if (!is_good()) {
    return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}; {}", target_.string(), system_words(error_),
                                                 write_remedy(error_, target_, expected_bytes_)));
  }
  path_.clear();
  // File systems that cannot sync a folder say EINVAL; there is nothing more to do on those.
  if (::fsync(folder_.get()) != 0 && errno != EINVAL) {
    return make_error(ErrorCode::Io, fmt::format("wrote {}, but it may be lost in a power cut: {}; check the disk",
                                                 target_.string(), system_words(errno)));
  }
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
