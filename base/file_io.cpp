// SPDX-License-Identifier: Apache-2.0
#include "base/file_io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <optional>
#include <system_error>

#include "base/bytes.h"
#include "base/result.h"

namespace farfield {

namespace fs = std::filesystem;

namespace {

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

std::string system_words(int error) { return std::error_code(error, std::generic_category()).message(); }

/// What the user can do about a failed write.
std::string write_remedy(int error, const fs::path& path, uint64_t bytes) {
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return fmt::format("it needs {}: free some space or choose another folder", format_bytes(bytes));
    case EACCES:
    case EPERM:
    case EROFS:
      return fmt::format("check the permissions of {} or choose another folder", folder_of(path).string());
    case ENOENT:
    case ENOTDIR:
      return fmt::format("create the folder {} first", folder_of(path).string());
    case EISDIR:
      return "a folder has this name: remove it or choose another";
    case EFBIG:
      return fmt::format("it needs {}: raise the file size limit (ulimit -f)", format_bytes(bytes));
    case EMFILE:
    case ENFILE:
      return "raise the limit of open files (ulimit -n)";
    default:
      return "check the disk";
  }
}

auto write_error(int error, const fs::path& path, uint64_t bytes) {
  return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}; {}", path.string(), system_words(error),
                                               write_remedy(error, path, bytes)));
}

/// Writes all bytes. Returns the errno of a failure, 0 for success.
int write_all(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), std::min<size_t>(bytes.size(), 1u << 30));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    if (written == 0) return EIO;  // cannot happen on a regular file; do not loop for ever if it does
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
  return 0;
}

/// Makes a rename durable. File systems that cannot sync a folder say EINVAL; there is nothing more to do on those.
int sync_folder(const FileDescriptor& folder) { return ::fsync(folder.get()) == 0 || errno == EINVAL ? 0 : errno; }

/// A file that is removed at the end unless it was renamed to its final name.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& final_path) : final_path_(final_path) {}
  ~TemporaryFile() {
    if (fd_ >= 0) ::close(fd_);
    if (exists_) ::unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  int create() {
    do {  // in a container each run has the same process id, and a killed one leaves its files
      path_ = temporary_name(final_path_);
      fd_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    } while (fd_ < 0 && errno == EEXIST);
    exists_ = fd_ >= 0;
    return exists_ ? 0 : errno;
  }
  int write(std::span<const std::byte> bytes) { return write_all(fd_, bytes); }
  /// fsync is where a full disk shows on file systems that allocate late; close is where it shows on NFS.
  int sync_and_close() {
    const int sync_error = ::fsync(fd_) == 0 ? 0 : errno;
    const int close_error = ::close(fd_) == 0 ? 0 : errno;
    fd_ = -1;
    return sync_error != 0 ? sync_error : close_error;
  }
  int rename_to_final() {
    if (::rename(path_.c_str(), final_path_.c_str()) != 0) return errno;
    exists_ = false;
    return 0;
  }

 private:
  static fs::path temporary_name(const fs::path& final_path) {
    static std::atomic<uint64_t> counter{0};  // relaxed: only uniqueness matters
    fs::path name = final_path;
    name += fmt::format(".tmp-{}-{}", ::getpid(), counter.fetch_add(1, std::memory_order_relaxed));
    return name;
  }

  fs::path path_, final_path_;
  int fd_ = -1;
  bool exists_ = false;
};

}  // namespace

Result<void> write_file_atomically(const fs::path& path, std::span<const std::span<const std::byte>> pieces) {
  uint64_t total_bytes = 0;
  for (const auto& piece : pieces) total_bytes += piece.size();

  // Opened before anything is written, so that only the disk itself can fail the last step.
  const FileDescriptor folder(::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() < 0) return write_error(errno, path, total_bytes);

  TemporaryFile file(path);
  int error = file.create();
  for (size_t i = 0; error == 0 && i < pieces.size(); ++i) error = file.write(pieces[i]);
  if (error == 0) error = file.sync_and_close();
  if (error == 0) error = file.rename_to_final();
  if (error != 0) return write_error(error, path, total_bytes);
  if (error = sync_folder(folder); error != 0) {
    return make_error(ErrorCode::Io, fmt::format("wrote {}, but it may be lost in a power cut: {}; check the disk",
                                                 path.string(), system_words(error)));
  }
  return {};
}

FileDescriptor::~FileDescriptor() {
  if (fd_ >= 0) ::close(fd_);
}

Result<RegularFile> open_regular_file(const fs::path& path) {
  // O_NONBLOCK: opening a pipe that nobody writes to would wait for ever.
  FileDescriptor fd(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  if (fd.get() < 0) {
    const int error = errno;
    if (error == ELOOP) {
      return make_error(ErrorCode::BadFile,
                        fmt::format("{} is a symbolic link: put the file itself in its place", path.string()));
    }
    const bool missing = error == ENOENT || error == ENOTDIR;
    return make_error(missing ? ErrorCode::NotFound : ErrorCode::Io,
                      fmt::format("cannot open {}: {}", path.string(), system_words(error)));
  }
  struct stat status;
  if (::fstat(fd.get(), &status) != 0) {
    return make_error(ErrorCode::Io, fmt::format("cannot read {}: {}", path.string(), system_words(errno)));
  }
  if (!S_ISREG(status.st_mode)) {
    return make_error(ErrorCode::BadFile, fmt::format("{} is not a regular file", path.string()));
  }
  return RegularFile{std::move(fd), static_cast<uint64_t>(status.st_size)};
}

Result<std::string> read_small_file(const fs::path& path, uint64_t max_bytes) {
  FARFIELD_TRY_LET(const auto file, open_regular_file(path));
  if (file.bytes > max_bytes) {
    return make_error(ErrorCode::BadFile, fmt::format("{} has {}; at most {} is expected", path.string(),
                                                      format_bytes(file.bytes), format_bytes(max_bytes)));
  }
  std::string text(file.bytes, '\0');
  for (size_t done = 0; done < text.size();) {
    const ssize_t got = ::read(file.descriptor.get(), text.data() + done, text.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
      return make_error(ErrorCode::Io, fmt::format("cannot read {}: {}", path.string(),
                                                   got < 0 ? system_words(errno) : "it became shorter meanwhile"));
    }
    done += static_cast<size_t>(got);
  }
  return text;
}

}  // namespace farfield
