// SPDX-License-Identifier: Apache-2.0
// The time that this process has had of its processors.
#pragma once

#include <ctime>

namespace farfield {

/// CPU seconds of all threads since the process began. Any thread.
inline double process_cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace farfield
