// SPDX-License-Identifier: Apache-2.0
// The host's message sink, called by one thread at a time.
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <utility>

#include "farfield/runtime.h"

namespace farfield {

/// Any thread.
class Messages {
 public:
  explicit Messages(MessageSink sink) : sink_(std::move(sink)) {}

  void report(Severity severity, const std::string& message) {
    if (!sink_) return;
    const std::lock_guard lock(mutex_);
    sink_(severity, message);
  }

  /// The first time that `said` is passed; it belongs to one message.
  void report_once(std::atomic<bool>& said, Severity severity, const std::string& message) {
    if (said.load(std::memory_order_relaxed) || said.exchange(true, std::memory_order_relaxed)) return;
    report(severity, message);
  }

 private:
  const MessageSink sink_;
  std::mutex mutex_;
};

}  // namespace farfield
