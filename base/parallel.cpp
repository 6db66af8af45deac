// SPDX-License-Identifier: Apache-2.0
#include "base/parallel.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#if defined(__SANITIZE_THREAD__)
#define FARFIELD_PLAIN_THREADS 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define FARFIELD_PLAIN_THREADS 1
#endif
#endif

namespace farfield {

#ifdef FARFIELD_PLAIN_THREADS

void parallel_for(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body) {
  grain = std::max<size_t>(grain, 1);
  std::atomic<size_t> next{0};  // relaxed: it only hands out ranges; join() orders the results
  const auto work = [&] {
    for (size_t begin; (begin = next.fetch_add(grain, std::memory_order_relaxed)) < count;) {
      body(begin, std::min(begin + grain, count));
    }
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < thread_count(); ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
}

void run_isolated(const std::function<void()>& body) { body(); }

#else

void parallel_for(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body) {
  grain = std::max<size_t>(grain, 1);
  const size_t ranges = (count + grain - 1) / grain;
  tbb::parallel_for(
      size_t{0}, ranges, [&](size_t range) { body(range * grain, std::min((range + 1) * grain, count)); },
      tbb::simple_partitioner());
}

void run_isolated(const std::function<void()>& body) { tbb::this_task_arena::isolate(body); }

#endif

ThreadLimit::ThreadLimit(int threads)
    : control_(threads > 0
                   ? new tbb::global_control(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads))
                   : nullptr) {}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(control_); }

int thread_count() {
  return static_cast<int>(
      std::min<size_t>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism),
                       static_cast<size_t>(tbb::this_task_arena::max_concurrency())));
}

}  // namespace farfield
