// SPDX-License-Identifier: Apache-2.0
// What the system says this process holds in memory (Linux, /proc).
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace farfield {

/// Resident set size now: anonymous, file and shared pages, as `ps` shows it. 0 if /proc cannot be read.
uint64_t resident_set_bytes();

/// The part of it that lies in mapped files and shared memory. 0 if /proc cannot be read.
uint64_t mapped_set_bytes();

/// The highest resident set size since construction. The kernel keeps it if it lets us reset its mark; otherwise a
/// thread looks every 5 ms. One at a time in a process: they share the kernel's mark.
class PeakMemory {
 public:
  PeakMemory();
  ~PeakMemory();
  PeakMemory(const PeakMemory&) = delete;
  PeakMemory& operator=(const PeakMemory&) = delete;

  uint64_t peak_bytes() const;

 private:
  void sample_until_stopped();

  bool kernel_keeps_mark_ = false;
  std::thread sampler_;
  std::atomic<uint64_t> sampled_peak_{0};  // relaxed: a lone number
  std::mutex mutex_;
  std::condition_variable stop_signal_;
  bool stop_ = false;  // guarded by mutex_
};

}  // namespace farfield
