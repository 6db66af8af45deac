// SPDX-License-Identifier: Apache-2.0
// One line on a terminal that says how far a long job is.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

namespace farfield {

/// Rewrites one line on standard error: "frame 3/10 [####    ] 42 %  0:12 left". Silent where standard error is not a
/// terminal. Calls may come from any thread; at most ten lines per second are written.
class ProgressLine {
 public:
  ProgressLine();
  /// Clears the line.
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// done: of the whole job, in [0, 1]. Time left is estimated from the time since construction.
  void update(double done, const std::string& what);
  /// Clears the line, so that ordinary output can follow. The next update() shows it again.
  void clear();

 private:
  const bool is_terminal_;
  const std::chrono::steady_clock::time_point start_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point last_written_;  // guarded by mutex_
  bool shown_ = false;                                  // guarded by mutex_
};

/// What update() writes: "frame 3/10 [########            ]  42 %  1:03 left".
std::string progress_text(double done, const std::string& what, double elapsed_seconds);

/// A number of seconds as people read it: "0:42", "3:07", "1:02:09". Negative and NaN count as 0.
std::string format_duration(double seconds);

}  // namespace farfield
