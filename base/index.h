// SPDX-License-Identifier: Apache-2.0
// Indices into arrays of vertices, faces, voxels: 32 bits everywhere, in memory and in files.
#pragma once

#include <cstdint>

namespace farfield {

using Index = uint32_t;

/// No such thing. So no array may be that long.
inline constexpr Index kNoIndex = 0xffffffffu;

}  // namespace farfield
