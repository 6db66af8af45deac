// SPDX-License-Identifier: Apache-2.0
// The few things this room asks of the file system: whole-or-absent writes, and reads that only regular files get.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "base/result.h"

namespace farfield {

/// What the system says of an errno.
std::string system_words(int error);

/// Writes the concatenated pieces to `path`, whole or not at all, as TemporaryFile does. Any thread. Errors: those of
/// TemporaryFile::commit().
Result<void> write_file_atomically(const std::filesystem::path& path,
                                   std::span<const std::span<const std::byte>> pieces);

/// An open file descriptor, closed at the end.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  FileDescriptor& operator=(FileDescriptor&&) = delete;
  ~FileDescriptor();
  int get() const { return fd_; }

 private:
  int fd_;
};

struct RegularFile {
  FileDescriptor descriptor;
  uint64_t bytes;
};

/// Opens a regular file for reading. Its name itself must not be a symbolic link: a baked asset is a folder of plain
/// files, and a link may lead out of it. Never blocks (pipes, devices). Errors: NotFound, Io, BadFile (not a regular
/// file, a link).
Result<RegularFile> open_regular_file(const std::filesystem::path& path);

/// Fills `bytes` from where an open file stands. path: for messages. Errors: Io (also if the file ends before).
Result<void> read_fully(int descriptor, std::span<std::byte> bytes, const std::filesystem::path& path);

/// Reads a whole regular file of at most `max_bytes`. Errors: those of open_regular_file, BadFile (too large).
Result<std::string> read_small_file(const std::filesystem::path& path, uint64_t max_bytes);

/// XXH3 of all bytes of a regular file. Errors: those of open_regular_file.
Result<uint64_t> hash_file(const std::filesystem::path& path);

/// Waits until a regular file that somebody else has written is on the disk. Errors: those of open_regular_file, Io.
Result<void> sync_file(const std::filesystem::path& path);

}  // namespace farfield
