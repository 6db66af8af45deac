// SPDX-License-Identifier: Apache-2.0
// Cryptomatte: which named things a pixel shows, and how much of each, for mattes without a matte pass
// [Friedman and Jones 2015]. Per pixel the things are ranked by coverage and written as pairs (id, coverage); an id is
// the hash of a name, and the file's header has the names.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "path_tracer/image.h"

namespace farfield {

/// MurmurHash3_x86_32 with seed 0, the specification's hash.
uint32_t murmur_hash3(std::string_view text);

/// What stands for a name in the image: its hash, changed in one bit where the same bits are no ordinary float. Never
/// 0, which stands for nothing.
uint32_t cryptomatte_id(std::string_view name);

/// Things that a pixel keeps. What ranks behind is not written.
inline constexpr size_t kCryptomatteRanks = 6;

/// "CryptoObject00.R", .G, .B, .A, "CryptoObject01.R", ...: kCryptomatteRanks pairs.
std::vector<std::string> cryptomatte_channels(const std::string& layer);

/// What a file's header has to say of a layer: cryptomatte/KEY/name, hash, conversion, manifest.
Metadata cryptomatte_metadata(const std::string& layer, const std::set<std::string>& names);

/// Samples of one pixel, counted by what they show. A value.
class IdCounts {
 public:
  /// id 0 (nothing) counts only towards the whole.
  void add(uint32_t id);
  /// Writes the kCryptomatteRanks pairs of the things that most samples show; equal counts by id. `to`: 2 floats each.
  void store_ranked(float* to) const;

 private:
  std::vector<std::pair<uint32_t, uint32_t>> counts_;  // id, samples
  uint32_t total_ = 0;
};

}  // namespace farfield
