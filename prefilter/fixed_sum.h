// SPDX-License-Identifier: Apache-2.0
// Sums that many threads add to and that come out the same in any order.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>

namespace farfield {

/// A sum in fixed point: steps of 2^-24, up to 2^39. For terms of about 1. Any thread may add; read it after they are
/// done.
class FixedSum {
 public:
  void add(double x) {
    // relaxed: only the sum matters, and whoever reads it has waited for the threads
    sum_.fetch_add(std::llround(x * kOne), std::memory_order_relaxed);
  }
  double value() const { return static_cast<double>(sum_.load(std::memory_order_relaxed)) / kOne; }

 private:
  static constexpr double kOne = 1 << 24;
  std::atomic<int64_t> sum_{0};
};

}  // namespace farfield
