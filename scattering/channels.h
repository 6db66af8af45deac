// SPDX-License-Identifier: Apache-2.0
// Which parts of a light model an asset has at all. The models are templates on this set, so that what is absent costs
// neither time nor memory; the choice is made once per level, not per sample.
#pragma once

#include <type_traits>

namespace farfield {

/// Bits of a set of channels.
enum Channel : unsigned {
  kDiffuse = 1,
  kSpecular = 2,
  kTransmission = 4,
  kNormals = 8,         ///< surfaces: sggx other than n n^T
  kSelfShadowing = 16,  ///< flakes: A other than 1
};

inline constexpr unsigned kSurfaceChannels = kDiffuse | kSpecular | kTransmission | kNormals;
inline constexpr unsigned kFlakeChannels = kDiffuse | kSpecular | kTransmission | kSelfShadowing;

/// Calls visitor(std::integral_constant<unsigned, C>()) with C = channels & kAll: from a set known at run time to a
/// template argument. Returns what it returns.
template <unsigned kAll, unsigned kChosen = 0, unsigned kBit = 1, typename Visitor>
decltype(auto) visit_channels(unsigned channels, Visitor&& visitor) {
  if constexpr (kBit > kAll) {
    return visitor(std::integral_constant<unsigned, kChosen>());
  } else if constexpr ((kAll & kBit) == 0) {
    return visit_channels<kAll, kChosen, kBit * 2>(channels, visitor);
  } else {
    return (channels & kBit) != 0 ? visit_channels<kAll, kChosen | kBit, kBit * 2>(channels, visitor)
                                  : visit_channels<kAll, kChosen, kBit * 2>(channels, visitor);
  }
}

/// What stands in a model for a part that it does not have: no bytes.
template <typename Part>
struct Absent {};
template <bool kIsPresent, typename Part>
using PartIf = std::conditional_t<kIsPresent, Part, Absent<Part>>;

}  // namespace farfield
