// SPDX-License-Identifier: Apache-2.0
// Parallel loops that may take long.
#pragma once

#include <string>

#include "base/job.h"
#include "base/parallel.h"

namespace farfield {

/// parallel_for() that reports the share of `count` that is done, from the calling thread alone, and that leaves out
/// what is not begun once the job is cancelled. False if it is: what was done is of no use.
bool parallel_for(const Job& job, const std::string& stage, size_t count, size_t grain,
                  const std::function<void(size_t begin, size_t end)>& body);

}  // namespace farfield
