// SPDX-License-Identifier: Apache-2.0
#include "base/file_io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <system_error>

#include "base/bytes.h"
#include "base/result.h"
#include "base/temporary_file.h"

namespace farfield {

namespace fs = std::filesystem;

std::string system_words(int error) { return std::error_code(error, std::generic_category()).message(); }

Result<void> write_file_atomically(const fs::path& path, std::span<const std::span<const std::byte>> pieces) {
  uint64_t total_bytes = 0;
  for (const auto& piece : pieces) total_bytes += piece.size();
  TemporaryFile file(path, total_bytes);
  for (const auto& piece : pieces) file.write(piece);
  return file.commit();
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

Result<void> read_fully(int descriptor, std::span<std::byte> bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t got = ::read(descriptor, bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
      return make_error(ErrorCode::Io, fmt::format("cannot read {}: {}", path.string(),
                                                   got < 0 ? system_words(errno) : "it became shorter meanwhile"));
    }
    bytes = bytes.subspan(static_cast<size_t>(got));
  }
  return {};
}

Result<std::string> read_small_file(const fs::path& path, uint64_t max_bytes) {
  FARFIELD_TRY_LET(const auto file, open_regular_file(path));
  if (file.bytes > max_bytes) {
    return make_error(ErrorCode::BadFile, fmt::format("{} has {}; at most {} is expected", path.string(),
                                                      format_bytes(file.bytes), format_bytes(max_bytes)));
  }
  std::string text(file.bytes, '\0');
  FARFIELD_TRY(read_fully(file.descriptor.get(), std::as_writable_bytes(std::span(text)), path));
  return text;
}

// Piece by piece: a shot hashes its frames while a budget counts what the process holds.
Result<uint64_t> hash_file(const fs::path& path) {
  FARFIELD_TRY_LET(const auto file, open_regular_file(path));
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), XXH3_freeState);
  if (!state || XXH3_64bits_reset(state.get()) != XXH_OK)
    return make_error(ErrorCode::Io, fmt::format("cannot read {}: out of memory", path.string()));
  std::array<std::byte, 16 * 1024> piece;
  for (uint64_t left = file.bytes; left > 0;) {
    const auto part = std::span(piece).first(std::min<uint64_t>(left, piece.size()));
    FARFIELD_TRY(read_fully(file.descriptor.get(), part, path));
    XXH3_64bits_update(state.get(), part.data(), part.size());
    left -= part.size();
  }
  return XXH3_64bits_digest(state.get());
}

Result<void> sync_file(const fs::path& path) {
  FARFIELD_TRY_LET(const auto file, open_regular_file(path));
  if (::fsync(file.descriptor.get()) == 0) return {};
  return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}", path.string(), system_words(errno)));
}

}  // namespace farfield
