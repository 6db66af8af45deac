// SPDX-License-Identifier: Apache-2.0
// Small glTF files for tests.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace farfield::test {

/// The bytes of numbers, as buffers hold them.
template <typename T>
std::string raw(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// A .glb of a JSON text and a binary chunk.
inline std::string glb(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto u32 = [](size_t v) { return raw<uint32_t>({static_cast<uint32_t>(v)}); };
  const size_t total = 12 + 8 + json.size() + (binary.empty() ? 0 : 8 + binary.size());
  std::string out = "glTF" + u32(2) + u32(total) + u32(json.size()) + "JSON" + json;
  if (!binary.empty()) out += u32(binary.size()) + std::string("BIN\0", 4) + binary;
  return out;
}

}  // namespace farfield::test
