// SPDX-License-Identifier: Apache-2.0
#include "base/parallel.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace farfield {
namespace {

TEST(ParallelFor, VisitsEachIndexOnce) {
  for (const size_t count : {size_t{0}, size_t{1}, size_t{7}, size_t{10000}}) {
    for (const size_t grain : {size_t{0}, size_t{1}, size_t{64}, size_t{20000}}) {
      std::vector<int> visits(count, 0);
      parallel_for(count, grain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) ++visits[i];
      });
      EXPECT_EQ(visits, std::vector<int>(count, 1)) << count << " by " << grain;
    }
  }
}

TEST(ThreadLimit, LimitsWhileAlive) {
  const int before = thread_count();
  {
    const ThreadLimit limit(1);
    EXPECT_EQ(thread_count(), 1);
  }
  EXPECT_EQ(thread_count(), before);
}

/// True on a thread while it is inside an isolated body.
thread_local bool is_inside = false;

TEST(RunIsolated, WaitingThreadTakesUpNoTasksFromOutside) {
  std::atomic<int> intruders{0};
  const auto nap = [](size_t microseconds) { std::this_thread::sleep_for(std::chrono::microseconds(microseconds)); };
  const auto isolated_work = [&] {
    is_inside = true;
    parallel_for(8, 1, [&](size_t begin, size_t) { nap(begin == 7 ? 1 : 500); });
    is_inside = false;
  };
  const ThreadLimit more_threads_than_processors(8);
  tbb::task_arena(8).execute([&] {
    parallel_for(4000, 1, [&](size_t begin, size_t) {
      if (is_inside) ++intruders;
      if (begin % 20 == 0 && !is_inside) run_isolated(isolated_work);
      nap(1);
    });
  });
  EXPECT_EQ(intruders, 0);
}

}  // namespace
}  // namespace farfield
