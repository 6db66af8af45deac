// SPDX-License-Identifier: Apache-2.0
#include "base/parallel_job.h"

#include <atomic>
#include <thread>

namespace farfield {

bool parallel_for(const Job& job, const std::string& stage, size_t count, size_t grain,
                  const std::function<void(size_t begin, size_t end)>& body) {
  std::atomic<size_t> done{0};  // relaxed: only for the progress
  const std::thread::id caller = std::this_thread::get_id();
  parallel_for(count, grain, [&](size_t begin, size_t end) {
    if (job.is_cancelled()) return;
    body(begin, end);
    const size_t done_now = done.fetch_add(end - begin, std::memory_order_relaxed) + end - begin;
    if (std::this_thread::get_id() == caller) {
      job.report(static_cast<double>(done_now) / static_cast<double>(count), stage);
    }
  });
  return !job.is_cancelled();
}

}  // namespace farfield
