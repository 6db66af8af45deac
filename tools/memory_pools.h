// SPDX-License-Identifier: Apache-2.0
// Free memory that stays with a process.
#pragma once

namespace farfield::tool {

/// For commands that promise to stay within a budget: the C library keeps free memory of every thread apart, where
/// textures that come and go under pressure leave up to half of their cache again (docs/results/textures.md). One pool
/// for all from now on. Before the first thread starts.
void use_one_memory_pool();

}  // namespace farfield::tool
