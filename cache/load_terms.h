// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>

namespace farfield {

/// As much memory as there is.
inline constexpr uint64_t kAnyBytes = std::numeric_limits<uint64_t>::max();

/// What the load of a level, or a build within it, may do.
struct LoadTerms {
  uint64_t most_bytes = kAnyBytes;            ///< more it must not take even for a moment, but fail with OutOfBudget
  const std::atomic<bool>* cancel = nullptr;  ///< polled meanwhile; once true, it had better fail with Cancelled

  /// What is left of them once so many bytes are taken.
  LoadTerms after(uint64_t bytes) const { return {most_bytes - std::min(most_bytes, bytes), cancel}; }
  bool is_cancelled() const { return cancel && cancel->load(std::memory_order_relaxed); }  // relaxed: it guards nothing
};

}  // namespace farfield
