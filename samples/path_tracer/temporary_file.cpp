// SPDX-License-Identifier: Apache-2.0
#include "samples/path_tracer/temporary_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <system_error>

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

}  // namespace farfield
