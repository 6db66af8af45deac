// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace farfield::test {

/// Makes `most` at least this, whoever else does so meanwhile.
template <typename T>
void raise_to(std::atomic<T>& most, T value) {
  for (T seen = most; seen < value && !most.compare_exchange_weak(seen, value);) {
  }
}

}  // namespace farfield::test
