// SPDX-License-Identifier: Apache-2.0
#include "import/read_file.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace farfield {
namespace {

using Bytes = std::vector<unsigned char>;

constexpr uint64_t kBombFloorBytes = 256ull << 20;
constexpr uint64_t kBombRatio = 100;  // text meshes pack 3 to 20 times

bool is_gzip(const Bytes& bytes) { return bytes.size() >= 3 && bytes[0] == 0x1f && bytes[1] == 0x8b && bytes[2] == 8; }

/// Inflates with its own buffer growing geometrically: the size that a gzip file promises is not to be trusted.
Result<Bytes> gunzip(const Bytes& packed, const std::string& name) {
  const uint64_t limit =
      std::min(kMaxFileBytes, std::max<uint64_t>(kBombFloorBytes, kBombRatio * static_cast<uint64_t>(packed.size())));
  z_stream stream{};
  if (inflateInit2(&stream, 15 + 16) != Z_OK) return make_error(ErrorCode::Io, fmt::format("{}: zlib failed", name));
  const std::unique_ptr<z_stream, int (*)(z_stream*)> guard(&stream, inflateEnd);

  Bytes out(std::min<uint64_t>(limit, 4 * static_cast<uint64_t>(packed.size()) + 4096));
  size_t used = 0;
  stream.next_in = const_cast<unsigned char*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  while (true) {
    if (used == out.size()) {
      if (out.size() >= limit) {
        return make_error(
            ErrorCode::Unsupported,
            fmt::format("{}: unpacks to more than {} bytes; unpack it yourself if that is right", name, limit));
      }
      out.resize(std::min<uint64_t>(limit, 2 * static_cast<uint64_t>(out.size())));
    }
    const size_t room = std::min<size_t>(out.size() - used, 1u << 30);
    stream.next_out = out.data() + used;
    stream.avail_out = static_cast<uInt>(room);
    const int status = inflate(&stream, Z_NO_FLUSH);
    used += room - stream.avail_out;
    if (status == Z_STREAM_END) {
      // Another member may follow (`cat a.gz b.gz`); anything else after the end is padding.
      if (stream.avail_in < 2 || stream.next_in[0] != 0x1f || stream.next_in[1] != 0x8b) break;
      inflateReset(&stream);
    } else if (status != Z_OK && !(status == Z_BUF_ERROR && stream.avail_out == 0)) {
      return make_error(ErrorCode::BadFile,
                        fmt::format("{}: gzip data is broken or cut short after {} unpacked bytes", name, used));
    } else if (stream.avail_in == 0 && stream.avail_out != 0) {
      return make_error(ErrorCode::BadFile,
                        fmt::format("{}: gzip data is cut short after {} unpacked bytes", name, used));
    }
  }
  out.resize(used);
  return out;
}

}  // namespace

Result<Bytes> read_file(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code failure;
  const auto status = std::filesystem::status(path, failure);
  if (!std::filesystem::exists(status)) return make_error(ErrorCode::NotFound, fmt::format("{}: no such file", name));
  // Folders, pipes and devices have no size to check against, and may never end.
  if (!std::filesystem::is_regular_file(status)) {
    return make_error(ErrorCode::Io, fmt::format("{}: not a regular file", name));
  }
  const uint64_t size = std::filesystem::file_size(path, failure);
  if (failure) return make_error(ErrorCode::Io, fmt::format("{}: {}", name, failure.message()));
  if (size > kMaxFileBytes) {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: {} bytes; files of 4 GiB and more have to be split", name, size));
  }

  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(name.c_str(), "rb"), std::fclose);
  if (!file) return make_error(ErrorCode::Io, fmt::format("{}: cannot be opened: {}", name, std::strerror(errno)));
  Bytes bytes(size);
  if (std::fread(bytes.data(), 1, bytes.size(), file.get()) != bytes.size()) {
    return make_error(ErrorCode::Io, fmt::format("{}: cannot be read: {}", name, std::strerror(errno)));
  }
  if (is_gzip(bytes)) return gunzip(bytes, name);
  return bytes;
}

}  // namespace farfield
