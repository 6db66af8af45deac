// SPDX-License-Identifier: Apache-2.0
// The project's Result is the one that hosts see.
#pragma once

#include "farfield/result.h"  // IWYU pragma: export
