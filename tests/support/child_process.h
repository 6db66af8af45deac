// SPDX-License-Identifier: Apache-2.0
// Work in a copy of the test program, for what depends on what a process has done before.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace farfield::test {

/// The work leaves nothing in this process: no holes in its heap, which would hide growth. What fails there fails here.
/// Before any thread is started.
template <typename Work>
void in_a_child_process(const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    work();
    _exit(::testing::Test::HasFailure() ? 1 : 0);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
}

}  // namespace farfield::test
