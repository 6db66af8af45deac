// SPDX-License-Identifier: Apache-2.0
#include "base/process_memory.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <string_view>

namespace farfield {

namespace {

constexpr std::chrono::milliseconds kSampleInterval{5};

// Reads with plain system calls into a buffer on the stack: measuring memory must not take any.
class ProcFile {
 public:
  explicit ProcFile(const char* path) {
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return;
    const ssize_t n = read(fd, buffer_, sizeof(buffer_));
    close(fd);
    if (n > 0) size_ = static_cast<size_t>(n);
  }
  std::string_view text() const { return {buffer_, size_}; }

 private:
  char buffer_[4096];
  size_t size_ = 0;
};

// The first number at or after `position`.
uint64_t number_after(std::string_view text, size_t position) {
  if (position >= text.size()) return 0;
  const size_t digit = text.find_first_of("0123456789", position);
  uint64_t value = 0;
  if (digit != std::string_view::npos) std::from_chars(text.data() + digit, text.data() + text.size(), value);
  return value;
}

uint64_t kernel_peak_bytes() {
  const ProcFile status("/proc/self/status");
  const size_t line = status.text().find("VmHWM:");
  return line == std::string_view::npos ? 0 : 1024 * number_after(status.text(), line);
}

// Number `column` of statm, from 0: size, resident, shared, ..., in pages.
uint64_t statm_bytes(int column) {
  const ProcFile statm("/proc/self/statm");
  size_t space = 0;
  for (int i = 0; i < column; ++i) space = statm.text().find(' ', space + 1);
  return number_after(statm.text(), space) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

bool reset_kernel_peak() {
  const int fd = open("/proc/self/clear_refs", O_WRONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool written = write(fd, "5", 1) == 1;  // proc(5): resets the peak resident set size, Linux 4.0
  close(fd);
  return written && kernel_peak_bytes() > 0;
}

}  // namespace

uint64_t resident_set_bytes() { return statm_bytes(1); }
uint64_t mapped_set_bytes() { return statm_bytes(2); }

PeakMemory::PeakMemory() : kernel_keeps_mark_(reset_kernel_peak()) {
  if (!kernel_keeps_mark_) sampler_ = std::thread([this] { sample_until_stopped(); });
}

PeakMemory::~PeakMemory() {
  if (!sampler_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  stop_signal_.notify_one();
  sampler_.join();
}

void PeakMemory::sample_until_stopped() {
  std::unique_lock lock(mutex_);
  while (!stop_) {
    const uint64_t peak = std::max(sampled_peak_.load(std::memory_order_relaxed), resident_set_bytes());
    sampled_peak_.store(peak, std::memory_order_relaxed);
    stop_signal_.wait_for(lock, kSampleInterval, [this] { return stop_; });
  }
}

uint64_t PeakMemory::peak_bytes() const {
  const uint64_t known = kernel_keeps_mark_ ? kernel_peak_bytes() : sampled_peak_.load(std::memory_order_relaxed);
  return std::max(known, resident_set_bytes());
}

}  // namespace farfield
