// SPDX-License-Identifier: Apache-2.0
// Where a time lies among keys that are evenly spaced from 0 to 1.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace farfield {

struct KeyPlace {
  size_t key;  ///< the earlier of the two that the time lies between
  double t;    ///< of the way to the next, in [0, 1]
};

/// Times outside of [0, 1] are its ends, NaN is 0. count: of keys, >= 2.
inline KeyPlace find_key_place(size_t count, float time) {
  const auto segments = static_cast<double>(count - 1);
  const double place = time > 0.0f ? std::min(time, 1.0f) * segments : 0.0;
  const double first = std::min(std::floor(place), segments - 1.0);
  return {static_cast<size_t>(first), place - first};
}

}  // namespace farfield
