// SPDX-License-Identifier: Apache-2.0
#include "base/big_vector.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>

#include "base/bytes.h"
#include "base/file_io.h"
#include "base/process_memory.h"

namespace farfield {
namespace {

constexpr std::align_val_t kAlignment{64};
constexpr uint64_t kMostMappedBytes = uint64_t{256} << 20;

[[noreturn]] void fail(const std::string& folder, size_t bytes, int error) {
  throw ScratchFull(
      {ErrorCode::Io, fmt::format("no room for {} in {}: {}; free some space or set TMPDIR to a folder that has it",
                                  format_bytes(bytes), folder, system_words(error))});
}

/// A file of zeros without a name. All of it has its place on the disk, so that no write to its pages can fail.
FileDescriptor unnamed_file(size_t bytes) {
  std::error_code unknown;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(unknown);
  if (unknown) fail("the temporary folder", bytes, unknown.value());
  std::string name = (folder / "farfield-XXXXXX").string();
  FileDescriptor file(::mkostemp(name.data(), O_CLOEXEC));
  if (file.get() < 0) fail(folder.string(), bytes, errno);
  ::unlink(name.c_str());
  if (const int error = ::posix_fallocate(file.get(), 0, static_cast<off_t>(bytes)); error != 0)
    fail(folder.string(), bytes, error);
  return file;
}

}  // namespace

void* allocate_scratch(size_t bytes) {
  if (bytes < kScratchFromBytes) return ::operator new(bytes, kAlignment);
  const FileDescriptor file = unnamed_file(bytes);
  void* block = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0);
  if (block == MAP_FAILED) fail("the address space", bytes, errno);
  return block;
}

void free_scratch(void* block, size_t bytes) noexcept {
  if (bytes < kScratchFromBytes)
    ::operator delete(block, kAlignment);
  else
    ::munmap(block, bytes);
}

void rest_scratch(const void* block, size_t bytes) noexcept {
  // Of a shared map of a file the pages' contents are the file's: nothing is lost, nothing has to be written now.
  if (bytes >= kScratchFromBytes) ::madvise(const_cast<void*>(block), bytes, MADV_DONTNEED);
}

bool is_much_in_memory() { return mapped_set_bytes() > kMostMappedBytes; }

}  // namespace farfield
