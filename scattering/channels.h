// SPDX-License-Identifier: Apache-2.0
// Which parts of a light model an asset has at all. The models are templates on this set, so that what is absent costs
// neither time nor memory.
//
// Three of the 32 models occur in products, and the library holds no others. An Interaction is one type whatever was
// hit, so it holds the two models with all channels (runtime/interaction_model.h); and a flake of the second scatters
// as a flat surface, whose normals are not a channel. A host that chose per level would need more of them: what that is
// worth is measured in docs/results/light.md, on the sets of tests/support/channel_sets.h.
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

inline constexpr unsigned kFlatChannels = kDiffuse | kSpecular | kTransmission;  ///< of a flat surface
inline constexpr unsigned kSurfaceChannels = kFlatChannels | kNormals;
inline constexpr unsigned kFlakeChannels = kFlatChannels | kSelfShadowing;

/// What stands in a model for a part that it does not have: no bytes.
template <typename Part>
struct Absent {};
template <bool kIsPresent, typename Part>
using PartIf = std::conditional_t<kIsPresent, Part, Absent<Part>>;

}  // namespace farfield
