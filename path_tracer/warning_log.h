// SPDX-License-Identifier: Apache-2.0
// What was said of a job, each line once.
#pragma once

#include <algorithm>
#include <mutex>
#include <string>
#include <vector>

namespace farfield {

/// Safe from any thread.
class WarningLog {
 public:
  /// False if the line was there already.
  bool add(const std::string& line) {
    const std::lock_guard lock(mutex_);
    if (std::find(lines_.begin(), lines_.end(), line) != lines_.end()) return false;
    lines_.push_back(line);
    return true;
  }
  /// In the order in which they came.
  std::vector<std::string> lines() const {
    const std::lock_guard lock(mutex_);
    return lines_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
};

}  // namespace farfield
