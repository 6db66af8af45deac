// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/warning_log.h"

#include <algorithm>
#include <utility>

namespace farfield {

namespace {

bool has(const std::vector<std::string>& lines, const std::string& line) {
  return std::find(lines.begin(), lines.end(), line) != lines.end();
}

}  // namespace

WarningLog::WarningLog(std::function<void(const std::string& line)> sink) : sink_(std::move(sink)) {}

void WarningLog::add(const std::string& line) {
  const std::lock_guard lock(mutex_);  // over the sink, too: lines of two threads do not mix
  if (has(lines_, line)) return;
  lines_.push_back(line);
  if (sink_) sink_(line);
}

std::vector<std::string> WarningLog::lines() const {
  const std::lock_guard lock(mutex_);
  return lines_;
}

void add_new_lines(std::vector<std::string>& lines, const std::vector<std::string>& more) {
  for (const std::string& line : more)
    if (!has(lines, line)) lines.push_back(line);
}

}  // namespace farfield
