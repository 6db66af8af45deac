// SPDX-License-Identifier: Apache-2.0
// Ctrl-C.
#pragma once

#include <atomic>

namespace farfield::tool {

/// From now on the first SIGINT or SIGTERM only sets the returned flag, so that jobs stop in order; a second one ends
/// the process at once. The flag lives as long as the process.
const std::atomic<bool>& catch_interrupts();

/// From now on this process gets a SIGTERM when the process `parent`, which started it, ends in any way; now, if it has
/// ended already. 0: nothing.
void end_with_parent(int parent);

}  // namespace farfield::tool
