// SPDX-License-Identifier: Apache-2.0
// The project's random stream is the one that hosts see.
#pragma once

#include "farfield/random.h"  // IWYU pragma: export
