// SPDX-License-Identifier: Apache-2.0
#include "tools/interrupt.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

namespace farfield::tool {
namespace {

TEST(EndWithParent, AtOnceIfTheParentHasEndedAlready) {
  EXPECT_EXIT(end_with_parent(1 << 30), testing::KilledBySignal(SIGTERM), "");
}

TEST(EndWithParent, HoweverTheParentEnds) {
  int alive[2];  // its writing end is open as long as the child lives
  ASSERT_EQ(::pipe(alive), 0);
  const pid_t parent = ::fork();
  ASSERT_GE(parent, 0);
  if (parent == 0) {
    const pid_t me = ::getpid();
    if (::fork() == 0) {
      end_with_parent(me);
      if (::write(alive[1], "x", 1) != 1) ::_exit(1);
      for (;;) ::pause();
    }
    for (;;) ::pause();
  }
  ::close(alive[1]);
  char ready;
  ASSERT_EQ(::read(alive[0], &ready, 1), 1);
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  pollfd end{alive[0], POLLIN, 0};
  ASSERT_EQ(::poll(&end, 1, 60000), 1) << "the child outlives its parent";
  EXPECT_EQ(::read(alive[0], &ready, 1), 0);
  ::close(alive[0]);
}

}  // namespace
}  // namespace farfield::tool
