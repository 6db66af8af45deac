// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_json.h"

#include <algorithm>
#include <cstring>

namespace farfield {
namespace {

// A .glb: 12 bytes of header, then chunks of 8 bytes of length and type and what is in them.
constexpr size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;

std::span<const unsigned char> chunk_at(std::span<const unsigned char> bytes, size_t begin) {
  if (begin > bytes.size() || bytes.size() - begin < kChunkHeaderBytes) return {};
  uint32_t length = 0;
  std::memcpy(&length, bytes.data() + begin, sizeof length);
  const size_t first = begin + kChunkHeaderBytes;
  return bytes.subspan(first, std::min<size_t>(length, bytes.size() - first));
}

}  // namespace

bool is_binary_gltf(std::span<const unsigned char> bytes) {
  return bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
}

bool may_be_json(std::span<const unsigned char> text) {
  constexpr unsigned char kByteOrderMark[] = {0xef, 0xbb, 0xbf};
  if (text.size() >= 3 && std::equal(text.begin(), text.begin() + 3, kByteOrderMark)) text = text.subspan(3);
  const auto begin = std::ranges::find_if_not(text, [](unsigned char c) { return std::strchr(" \t\r\n", c) && c; });
  return begin != text.end() && *begin == '{';
}

std::span<const unsigned char> json_text(std::span<const unsigned char> bytes) {
  return is_binary_gltf(bytes) ? chunk_at(bytes, kHeaderBytes) : bytes;
}

std::span<const unsigned char> binary_chunk(std::span<const unsigned char> bytes) {
  if (!is_binary_gltf(bytes)) return {};
  return chunk_at(bytes, kHeaderBytes + kChunkHeaderBytes + json_text(bytes).size());
}

bool is_too_deep(std::span<const unsigned char> json) {
  int depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < json.size(); ++i) {
    const unsigned char c = json[i];
    if (in_string) {
      if (c == '\\')
        ++i;
      else if (c == '"')
        in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxJsonDepth) return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

std::optional<nlohmann::json> parse_json(std::span<const unsigned char> text) {
  if (is_too_deep(text)) return std::nullopt;
  auto json = nlohmann::json::parse(text.begin(), text.end(), nullptr, false);
  if (!json.is_object()) return std::nullopt;
  return json;
}

}  // namespace farfield
