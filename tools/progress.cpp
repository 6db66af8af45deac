// SPDX-License-Identifier: Apache-2.0
#include "tools/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace farfield {

namespace {
constexpr int kBarWidth = 20;
constexpr std::chrono::milliseconds kShortestInterval{100};
constexpr const char* kEraseLine = "\r\x1b[K";
}  // namespace

ProgressLine::ProgressLine() : is_terminal_(isatty(STDERR_FILENO) != 0), start_(std::chrono::steady_clock::now()) {}

ProgressLine::~ProgressLine() { clear(); }

void ProgressLine::update(double done, const std::string& what) {
  if (!is_terminal_) return;
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard lock(mutex_);
  if (shown_ && now - last_written_ < kShortestInterval) return;
  last_written_ = now;
  shown_ = true;
  fmt::print(stderr, "{}{}", kEraseLine,
             progress_text(done, what, std::chrono::duration<double>(now - start_).count()));
  std::fflush(stderr);
}

void ProgressLine::clear() {
  const std::lock_guard lock(mutex_);
  if (!shown_) return;
  shown_ = false;
  fmt::print(stderr, "{}", kEraseLine);
  std::fflush(stderr);
}

std::string progress_text(double done, const std::string& what, double elapsed_seconds) {
  done = std::isfinite(done) ? std::clamp(done, 0.0, 1.0) : 0.0;
  const auto filled = static_cast<size_t>(done * kBarWidth);
  std::string text = fmt::format("{} [{:<{}}] {:3.0f} %", what, std::string(filled, '#'), kBarWidth, 100 * done);
  // Before 1 % an estimate would only jump about.
  if (done >= 0.01 && done < 1) text += fmt::format("  {} left", format_duration(elapsed_seconds * (1 - done) / done));
  return text;
}

std::string format_duration(double seconds) {
  if (!(seconds >= 0)) seconds = 0;  // NaN too
  const auto whole = static_cast<int64_t>(std::min(seconds + 0.5, 1e15));
  if (whole < 3600) return fmt::format("{}:{:02}", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

}  // namespace farfield
