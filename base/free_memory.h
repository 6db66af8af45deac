// SPDX-License-Identifier: Apache-2.0
// Giving back the memory of a vector that is no longer needed.
#pragma once

#include <vector>

namespace farfield {

/// `values = {}` empties a vector and keeps its memory.
template <typename T, typename Allocator>
void free_memory(std::vector<T, Allocator>& values) {
  std::vector<T, Allocator>().swap(values);
}

}  // namespace farfield
