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
