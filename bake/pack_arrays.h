// SPDX-License-Identifier: Apache-2.0
// What levels of surfaces and flakes and levels of fog are packed with.
#pragma once

#include <algorithm>
#include <bit>
#include <vector>

#include "base/free_memory.h"
#include "cache/level.h"

namespace farfield {

/// Arrays that are nothing but their default are not stored.
template <typename T>
void drop_if_all(std::vector<T>& values, const T& default_value) {
  if (std::ranges::all_of(values, [&](const T& v) { return v == default_value; })) free_memory(values);
}

/// Fills in the prefix sums of a brick's mask. Returns how many voxels it has.
inline uint32_t sum_up_mask(Brick& brick) {
  uint32_t count = 0;
  for (size_t word = 0; word < brick.mask.size(); ++word) {
    brick.prefix[word] = static_cast<uint16_t>(count);
    count += static_cast<uint32_t>(std::popcount(brick.mask[word]));
  }
  return count;
}

}  // namespace farfield
