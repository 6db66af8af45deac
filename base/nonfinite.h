// SPDX-License-Identifier: Apache-2.0
// The two values that no measure has.
#pragma once

#include <limits>

namespace farfield {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

}  // namespace farfield
