// SPDX-License-Identifier: Apache-2.0
#include "base/parallel_job.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace farfield {
namespace {

TEST(ParallelJob, VisitsAllAndReportsFromTheCallingThreadAlone) {
  const std::thread::id caller = std::this_thread::get_id();
  std::vector<int> visits(10000, 0);
  double last = 0;
  int strangers = 0;
  Job job;
  job.progress = [&](double done, const std::string& stage) {
    strangers += std::this_thread::get_id() != caller || stage != "walk";
    EXPECT_TRUE(done > 0 && done <= 1) << done;
    last = done;
  };
  EXPECT_TRUE(parallel_for(job, "walk", visits.size(), 16, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) ++visits[i];
  }));
  EXPECT_EQ(visits, std::vector<int>(10000, 1));
  EXPECT_GT(last, 0);
  EXPECT_EQ(strangers, 0);
}

TEST(ParallelJob, LeavesOutWhatIsNotBegunWhenCancelled) {
  std::atomic<bool> cancel{false};
  std::atomic<int> ranges{0};
  const Job job{{}, &cancel};
  EXPECT_FALSE(parallel_for(job, "walk", 100000, 1, [&](size_t, size_t) {
    ++ranges;
    cancel = true;
  }));
  EXPECT_GE(ranges, 1);
  EXPECT_LE(ranges, 64);  // those under way on the other threads
  EXPECT_TRUE(parallel_for(Job{}, "walk", 0, 1, [&](size_t, size_t) { ++ranges; }));
}

}  // namespace
}  // namespace farfield
