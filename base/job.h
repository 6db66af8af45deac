// SPDX-License-Identifier: Apache-2.0
// What a long call owes its caller: how far it is, and to stop when asked.
#pragma once

#include <atomic>
#include <functional>
#include <string>

namespace farfield {

/// Passed down to whatever works for long. Empty, it neither reports nor stops. Thread-safe as far as `progress` is.
struct Job {
  std::function<void(double done, const std::string& stage)> progress;  ///< done: of the whole, in [0, 1]
  const std::atomic<bool>* cancel = nullptr;  ///< polled often; once true, the call ends with ErrorCode::Cancelled

  void report(double done, const std::string& stage) const {
    if (progress) progress(done, stage);
  }
  bool is_cancelled() const {
    return cancel != nullptr && cancel->load(std::memory_order_relaxed);  // relaxed: a flag, it guards no data
  }

  /// A part of this job, which it must not outlive: all that the part does lies between `begin` and `end` of the whole
  /// and is called `stage`.
  Job step(const std::string& stage, double begin, double end) const {
    if (!progress) return {{}, cancel};
    return {[this, stage, begin, end](double done, const std::string&) { report(begin + done * (end - begin), stage); },
            cancel};
  }
  /// This job without reports.
  Job quiet() const { return {{}, cancel}; }
};

}  // namespace farfield
