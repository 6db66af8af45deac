// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/cryptomatte.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>

namespace farfield {

namespace {

constexpr size_t kPairsPerLayer = 2;  // R, G and B, A

// The 4 bytes at text[i] as a little-endian number; those behind the end are 0.
uint32_t block_at(std::string_view text, size_t i) {
  uint32_t block = 0;
  for (size_t k = 0; k < 4 && i + k < text.size(); ++k)
    block |= static_cast<uint32_t>(static_cast<unsigned char>(text[i + k])) << (8 * k);
  return block;
}

}  // namespace

uint32_t murmur_hash3(std::string_view text) {
  uint32_t hash = 0;
  for (size_t i = 0; i < text.size(); i += 4) {
    hash ^= std::rotl(block_at(text, i) * 0xcc9e2d51u, 15) * 0x1b873593u;
    if (i + 4 <= text.size()) hash = std::rotl(hash, 13) * 5 + 0xe6546b64u;  // not for the tail
  }
  hash ^= static_cast<uint32_t>(text.size());
  hash = (hash ^ (hash >> 16)) * 0x85ebca6bu;
  hash = (hash ^ (hash >> 13)) * 0xc2b2ae35u;
  return hash ^ (hash >> 16);
}

uint32_t cryptomatte_id(std::string_view name) {
  const uint32_t hash = murmur_hash3(name);
  const uint32_t exponent = hash >> 23 & 0xffu;
  const bool is_ordinary = exponent != 0 && exponent != 0xffu;  // neither 0 nor denormal, neither infinite nor NaN
  return is_ordinary ? hash : hash ^ (1u << 23);
}

std::vector<std::string> cryptomatte_channels(const std::string& layer) {
  std::vector<std::string> channels;
  for (size_t i = 0; i < kCryptomatteRanks / kPairsPerLayer; ++i)
    for (const char c : {'R', 'G', 'B', 'A'}) channels.push_back(fmt::format("{}{:02}.{}", layer, i, c));
  return channels;
}

Metadata cryptomatte_metadata(const std::string& layer, const std::set<std::string>& names) {
  nlohmann::json manifest = nlohmann::json::object();
  for (const std::string& name : names) manifest[name] = fmt::format("{:08x}", cryptomatte_id(name));
  const std::string key = fmt::format("cryptomatte/{:.7}/", fmt::format("{:08x}", murmur_hash3(layer)));
  return {{key + "name", layer},
          {key + "hash", std::string("MurmurHash3_32")},
          {key + "conversion", std::string("uint32_to_float32")},
          {key + "manifest", manifest.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)}};
}

void IdCounts::add(uint32_t id) {
  ++total_;
  if (id == 0) return;
  const auto found = std::find_if(counts_.begin(), counts_.end(), [&](const auto& entry) { return entry.first == id; });
  if (found != counts_.end())
    ++found->second;
  else
    counts_.emplace_back(id, 1);
}

void IdCounts::store_ranked(float* to) const {
  auto ranked = counts_;
  std::sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first < b.first;
  });
  ranked.resize(kCryptomatteRanks);
  for (const auto& [id, count] : ranked) {
    *to++ = std::bit_cast<float>(id);
    *to++ = total_ > 0 ? static_cast<float>(count) / static_cast<float>(total_) : 0.0f;
  }
}

}  // namespace farfield
