// SPDX-License-Identifier: Apache-2.0
// Parallel loops. TBB does the work, except under ThreadSanitizer, which does not understand TBB: there the same
// loop runs on plain threads, so that real races of ours are seen.
#pragma once

#include <cstddef>
#include <functional>

namespace farfield {

/// Calls body(begin, end) for disjoint ranges that cover [0, count), each at most `grain` long, from several
/// threads. Returns when all are done. The partition into ranges does not depend on the number of threads.
/// The body must not throw.
void parallel_for(size_t count, size_t grain, const std::function<void(size_t begin, size_t end)>& body);

/// Calls body() so that whoever waits inside it (for its own parallel_for, for an Embree build) takes up only tasks
/// that belong to it meanwhile, not others of the caller's. For work that other tasks wait for. The body must not
/// throw.
void run_isolated(const std::function<void()>& body);

/// Limits parallel_for to `threads` (0: as many as the machine has) while alive. One at a time, from the main thread.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  void* control_;
};

/// How many threads parallel_for uses now.
int thread_count();

}  // namespace farfield
