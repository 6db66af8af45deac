// SPDX-License-Identifier: Apache-2.0
#include "bake_api/memory_guard.h"

#include <chrono>

#include "base/process_memory.h"

namespace farfield {
namespace {

constexpr std::chrono::milliseconds kInterval{10};

}  // namespace

MemoryGuard::MemoryGuard(uint64_t limit_bytes, const std::atomic<bool>* caller_cancel)
    : limit_bytes_(limit_bytes), start_bytes_(resident_set_bytes()), caller_cancel_(caller_cancel) {
  if (limit_bytes > 0) watcher_ = std::thread([this] { watch(); });
}

MemoryGuard::~MemoryGuard() {
  if (!watcher_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  stop_signal_.notify_one();
  watcher_.join();
}

void MemoryGuard::watch() {
  std::unique_lock lock(mutex_);
  while (!stop_) {
    const uint64_t now = resident_set_bytes();
    if (now > start_bytes_ + limit_bytes_ && exceeded_bytes_ == 0) exceeded_bytes_ = now - start_bytes_;
    if (exceeded_bytes_ > 0 || (caller_cancel_ && *caller_cancel_)) cancel_ = true;
    stop_signal_.wait_for(lock, kInterval, [this] { return stop_; });
  }
}

}  // namespace farfield
