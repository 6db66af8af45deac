// SPDX-License-Identifier: Apache-2.0
#include "base/parallel.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace farfield
