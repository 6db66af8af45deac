// SPDX-License-Identifier: Apache-2.0
// How long the steps of a bake take, for its report.
#pragma once

#include <chrono>

namespace farfield {

/// Seconds since it was made.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

}  // namespace farfield
