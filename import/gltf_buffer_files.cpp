// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_buffer_files.h"

#include <fmt/format.h>

#include <cctype>
#include <charconv>

#include "import/read_file.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kOneByte = "data:application/octet-stream;base64,AA==";

bool is_external(const Json& buffer) {
  if (!buffer.is_object() || !buffer.contains("uri") || !buffer["uri"].is_string()) return false;
  if (!buffer.contains("byteLength") || !buffer["byteLength"].is_number_unsigned()) return false;
  const std::string& uri = buffer["uri"].get_ref<const std::string&>();
  return !uri.empty() && !uri.starts_with("data:");
}

}  // namespace

fs::path GltfBufferFiles::path_of_uri(const std::string& uri) {
  std::string out;
  for (size_t i = 0; i < uri.size(); ++i) {
    unsigned value = 0;
    const char* digits = uri.data() + i + 1;
    const bool is_escape = uri[i] == '%' && i + 2 < uri.size() &&
                           std::isxdigit(static_cast<unsigned char>(digits[0])) &&
                           std::isxdigit(static_cast<unsigned char>(digits[1]));
    if (is_escape) {
      std::from_chars(digits, digits + 2, value, 16);
      i += 2;
    }
    out += is_escape ? static_cast<char>(value) : uri[i];
  }
  return fs::path(out).relative_path();  // an absolute name means one in the folder, too
}

Result<GltfBufferFiles> GltfBufferFiles::take_from(Json& json, const fs::path& gltf) {
  GltfBufferFiles out;
  if (!json.contains("buffers") || !json["buffers"].is_array()) return out;
  const fs::path folder = gltf.parent_path();
  for (size_t i = 0; i < json["buffers"].size(); ++i) {
    Json& entry = json["buffers"][i];
    if (!is_external(entry)) continue;
    Buffer buffer;
    buffer.in_folder = path_of_uri(entry["uri"].get<std::string>());
    buffer.path = folder / buffer.in_folder;
    buffer.promised_bytes = entry["byteLength"].get<uint64_t>();
    std::error_code failure;
    if (!fs::is_regular_file(buffer.path, failure)) {
      return make_error(ErrorCode::NotFound,
                        fmt::format("{}: buffer {}: there is no file {}; put it beside the glTF file", gltf.string(), i,
                                    buffer.in_folder.string()));
    }
    entry["uri"] = kOneByte;
    entry["byteLength"] = 1;
    out.buffers_.emplace(i, std::move(buffer));
  }
  return out;
}

uint64_t GltfBufferFiles::total_bytes() const {
  uint64_t bytes = 0;
  for (const auto& [number, buffer] : buffers_) bytes += buffer.promised_bytes;
  return bytes;
}

Result<std::span<const unsigned char>> GltfBufferFiles::bytes(size_t number) {
  Buffer& buffer = buffers_.at(number);
  if (!buffer.bytes.empty() || buffer.promised_bytes == 0) return std::span<const unsigned char>(buffer.bytes);
  FARFIELD_TRY_LET(auto read, read_file(buffer.path));
  if (read.size() != buffer.promised_bytes) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: {} bytes, and {} by the glTF file; export both again",
                                                      buffer.path.string(), read.size(), buffer.promised_bytes));
  }
  buffer.bytes = std::move(read);
  files_read_.push_back({buffer.in_folder.generic_string(), hash_values<unsigned char>(buffer.bytes)});
  return std::span<const unsigned char>(buffer.bytes);
}

}  // namespace farfield
