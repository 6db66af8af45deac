// SPDX-License-Identifier: Apache-2.0
// Hashes: XXH3 for content, a cheap integer mixer for seeds.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace farfield {

/// XXH3 (64 bit) of the bytes. Same on every machine of the same byte order.
uint64_t hash_bytes(std::span<const std::byte> bytes, uint64_t seed = 0);

/// The same for any contiguous trivially copyable values.
template <typename T>
uint64_t hash_values(std::span<const T> values, uint64_t seed = 0) {
  return hash_bytes(std::as_bytes(values), seed);
}

/// A file by name and content.
struct HashedFile {
  std::string path;
  uint64_t hash = 0;  ///< of its bytes, unpacked if it is gzipped; 0: it was not there
  friend bool operator==(const HashedFile&, const HashedFile&) = default;
};

/// 16 lower-case hexadecimal digits, as manifests write hashes.
std::string to_hex(uint64_t value);
/// What to_hex() wrote; nothing for other text.
std::optional<uint64_t> from_hex(std::string_view digits);

/// Bijective mixing of 64 bits (splitmix64 finaliser): neighbouring inputs give unrelated outputs.
inline constexpr uint64_t mix64(uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// One seed from two, order dependent.
inline constexpr uint64_t mix64(uint64_t a, uint64_t b) { return mix64(mix64(a + 0x9e3779b97f4a7c15ull) ^ b); }

/// The top 24 bits as a float in [0, 1).
inline constexpr float to_unit_float(uint64_t bits) { return static_cast<float>(bits >> 40) * 0x1p-24f; }

}  // namespace farfield
