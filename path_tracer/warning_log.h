// SPDX-License-Identifier: Apache-2.0
// Each warning once, to a person and into the report.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace farfield {

/// Thread-safe.
class WarningLog {
 public:
  /// sink: told each line when it comes first; may be empty.
  explicit WarningLog(std::function<void(const std::string& line)> sink);

  void add(const std::string& line);
  /// What was added, each once, in the order it came.
  std::vector<std::string> lines() const;

 private:
  const std::function<void(const std::string& line)> sink_;
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;  // guarded by mutex_
};

/// Adds to `lines` those of `more` that it does not have.
void add_new_lines(std::vector<std::string>& lines, const std::vector<std::string>& more);

}  // namespace farfield
