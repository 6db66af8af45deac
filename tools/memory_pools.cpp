// SPDX-License-Identifier: Apache-2.0
#include "tools/memory_pools.h"

#include <malloc.h>

namespace farfield::tool {

void use_one_memory_pool() { mallopt(M_ARENA_MAX, 1); }

}  // namespace farfield::tool
