// SPDX-License-Identifier: Apache-2.0
// Whole files into memory, gunzipped when they are gzipped.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/result.h"

namespace farfield {

/// No file and no unpacked content may be larger: 32-bit offsets of the formats end here.
inline constexpr uint64_t kMaxFileBytes = 0xffffffffull;

/// The file's bytes. Content that starts with gzip's magic number is unpacked, whatever the file is called; all gzip
/// members are joined. Unpacked content larger than 256 MiB and more than 100 times the packed size is taken for a
/// bomb. Errors: NotFound, Io (not a regular file, unreadable), Unsupported (too large), BadFile (broken gzip data).
Result<std::vector<unsigned char>> read_file(const std::filesystem::path& path);

}  // namespace farfield
