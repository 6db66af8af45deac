// SPDX-License-Identifier: Apache-2.0
#include "cache/loader_thread.h"

#include <sys/resource.h>

namespace farfield {

namespace {

// On Linux this is about the calling thread alone. A failure only means that it competes with rays.
void lower_priority() {
  constexpr int kNicer = 10;
  ::setpriority(PRIO_PROCESS, 0, ::getpriority(PRIO_PROCESS, 0) + kNicer);
}

}  // namespace

LoaderThread::~LoaderThread() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    queue_.clear();
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void LoaderThread::resize(size_t count) {
  while (requested_.size() < count) requested_.emplace_back(false);
}

void LoaderThread::request(size_t item) {
  if (requested_[item].load(std::memory_order_relaxed)) return;
  if (requested_[item].exchange(true, std::memory_order_relaxed)) return;
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(item);
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  }
  changed_.notify_all();
}

void LoaderThread::clear() {
  const std::lock_guard lock(mutex_);
  queue_.clear();
  for (std::atomic<bool>& flag : requested_) flag.store(false, std::memory_order_relaxed);
}

void LoaderThread::forget() {
  clear();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return !is_busy_; });
}

void LoaderThread::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return queue_.empty() && !is_busy_; });
}

void LoaderThread::run() {
  if (priority_ == Priority::Low) lower_priority();
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return is_stopping_ || !queue_.empty(); });
    if (is_stopping_) return;
    const size_t item = queue_.front();
    queue_.pop_front();
    is_busy_ = true;
    lock.unlock();
    load_(item);
    lock.lock();
    is_busy_ = false;
    changed_.notify_all();
  }
}

}  // namespace farfield
