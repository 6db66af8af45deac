// SPDX-License-Identifier: Apache-2.0
// Which of many numbered things belong together, as they are joined two by two.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace farfield {

/// Sets of the numbers below a count, each known by its least member. Not for several threads at once.
class DisjointSets {
 public:
  explicit DisjointSets(size_t count) : towards_least_(count) {
    std::iota(towards_least_.begin(), towards_least_.end(), 0u);
  }
  /// The least member of the set that i is in.
  uint32_t least_of(uint32_t i) {
    while (towards_least_[i] != i) i = towards_least_[i] = towards_least_[towards_least_[i]];
    return i;
  }
  void join(uint32_t a, uint32_t b) {
    a = least_of(a), b = least_of(b);
    towards_least_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<uint32_t> towards_least_;
};

}  // namespace farfield
