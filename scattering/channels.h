// SPDX-License-Identifier: Apache-2.0
// Which parts of a light model an asset has at all. The models are templates on this set, so that what is absent costs
// neither time nor memory.
//
// Two of the models occur in products, and the library holds no others: an Interaction is one type whatever was hit, so
// it holds those with all channels (runtime/interaction_model.h). A host that chose per level would need more of them:
// what that is worth is measured in docs/results/light.md, on the sets of tests/support/channel_sets.h.
#pragma once

#include <type_traits>

namespace farfield {

/// Bits of a set of channels.
enum Channel : unsigned {
  kDiffuse = 1,
  kSpecular = 2,
  kTransmission = 4,
  kSelfShadowing = 8,  ///< flakes: A other than 1
};

inline constexpr unsigned kSurfaceChannels = kDiffuse | kSpecular | kTransmission;
inline constexpr unsigned kFlakeChannels = kSurfaceChannels | kSelfShadowing;

/// What stands in a model for a part that it does not have: no bytes.
template <typename Part>
struct Absent {};
template <bool kIsPresent, typename Part>
using PartIf = std::conditional_t<kIsPresent, Part, Absent<Part>>;

}  // namespace farfield
