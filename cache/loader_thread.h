// SPDX-License-Identifier: Apache-2.0
// A thread that loads levels while rays go on: with coarser ones (Residency::Progressive), or ahead of the next frame.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace farfield {

/// Loads requested items one after the other, first come first served. request() is safe from any thread; the rest is
/// for one thread at a time, with no request() running. The thread starts with the first request. One of low priority
/// gets what processor time others leave.
class LoaderThread {
 public:
  enum class Priority { Normal, Low };
  explicit LoaderThread(std::function<void(size_t item)> load, Priority priority = Priority::Normal)
      : load_(std::move(load)), priority_(priority) {}
  ~LoaderThread();
  LoaderThread(const LoaderThread&) = delete;
  LoaderThread& operator=(const LoaderThread&) = delete;

  /// Makes room for items 0 .. count - 1.
  void resize(size_t count);
  /// Asks for an item, once: further requests for it are one atomic read, until forget().
  void request(size_t item);
  /// Drops what is waiting, and lets every item be requested again.
  void clear();
  /// The same, and waits for the load that runs.
  void forget();
  /// Waits until everything that was requested is done.
  void drain();

 private:
  void run();

  const std::function<void(size_t)> load_;
  const Priority priority_;
  std::deque<std::atomic<bool>> requested_;  ///< relaxed: only keeps the queue short

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<size_t> queue_;  ///< guarded by mutex_, as are the following
  bool is_busy_ = false;
  bool is_stopping_ = false;
  std::thread thread_;
};

}  // namespace farfield
