// SPDX-License-Identifier: Apache-2.0
// A bake that may not take more memory than its host allows.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace farfield {

/// Watches the process while it lives: cancel() becomes true once the resident set has grown by more than the limit
/// since construction, or the caller's flag is set. Without a limit it is just the caller's flag.
class MemoryGuard {
 public:
  /// limit_bytes: 0 is none. caller_cancel: may be null; outlives the guard.
  MemoryGuard(uint64_t limit_bytes, const std::atomic<bool>* caller_cancel);
  ~MemoryGuard();
  MemoryGuard(const MemoryGuard&) = delete;
  MemoryGuard& operator=(const MemoryGuard&) = delete;

  const std::atomic<bool>* cancel() const { return watcher_.joinable() ? &cancel_ : caller_cancel_; }
  /// Bytes that the process had grown by when that was too much; 0 if it never was.
  uint64_t exceeded_bytes() const { return exceeded_bytes_.load(); }

 private:
  void watch();

  const uint64_t limit_bytes_, start_bytes_;
  const std::atomic<bool>* const caller_cancel_;
  std::atomic<bool> cancel_{false};
  std::atomic<uint64_t> exceeded_bytes_{0};
  std::mutex mutex_;
  std::condition_variable stop_signal_;
  bool stop_ = false;  // guarded by mutex_
  std::thread watcher_;
};

}  // namespace farfield
