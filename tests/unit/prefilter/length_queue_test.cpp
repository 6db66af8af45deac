// SPDX-License-Identifier: Apache-2.0
#include "prefilter/length_queue.h"

#include <gtest/gtest.h>

#include <queue>

#include "base/random.h"

namespace farfield {
namespace {

struct NumberedEdge {
  double length2 = 0;
  int number = 0;
  friend bool operator<(const NumberedEdge& l, const NumberedEdge& r) {
    return l.length2 != r.length2 ? l.length2 > r.length2 : l.number > r.number;
  }
};

/// Pushes and pops in turns, also edges shorter than those that are gone, and many of one length.
TEST(LengthQueue, HasTheOrderOfAPriorityQueue) {
  for (const size_t expected : {size_t{0}, size_t{20000}, size_t{1} << 30}) {
    LengthQueue<NumberedEdge> queue(4.0, expected);
    std::priority_queue<NumberedEdge> wanted;
    Rng rng(3);
    int number = 0;
    const auto push = [&] {
      const double length2 = rng.next() < 0.2f ? 1.0 : 4.0 * static_cast<double>(rng.next());
      queue.push({length2, number});
      wanted.push({length2, number++});
    };
    for (int i = 0; i < 20000; ++i) push();
    NumberedEdge edge;
    while (queue.pop(edge)) {
      ASSERT_FALSE(wanted.empty());
      ASSERT_EQ(edge.number, wanted.top().number);
      wanted.pop();
      if (number < 60000 && rng.next() < 0.7f) push();
    }
    EXPECT_TRUE(wanted.empty());
    EXPECT_GT(number, 30000);
  }
}

TEST(LengthQueue, TakesTheLongestAndLengthsOfNothing) {
  LengthQueue<NumberedEdge> queue(2.0, 10000);
  queue.push({2.0, 1});
  NumberedEdge edge;
  EXPECT_TRUE(queue.pop(edge));
  queue.push({0.0, 2});
  EXPECT_TRUE(queue.pop(edge));
  EXPECT_EQ(edge.number, 2);
  EXPECT_FALSE(queue.pop(edge));
  LengthQueue<NumberedEdge> of_nothing(0.0, 10);
  of_nothing.push({0.0, 3});
  EXPECT_TRUE(of_nothing.pop(edge));
  EXPECT_FALSE(of_nothing.pop(edge));
}

}  // namespace
}  // namespace farfield
