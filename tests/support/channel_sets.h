// SPDX-License-Identifier: Apache-2.0
// SurfaceModel and FlakeModel for every set of channels: target test_channel_sets holds those that the library, which
// has only what occurs in products (scattering/channels.h), does not.
#pragma once

#include <type_traits>

#include "scattering/channels.h"

namespace farfield::test {

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

}  // namespace farfield::test
