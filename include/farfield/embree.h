// SPDX-License-Identifier: Apache-2.0
// Embree, whose devices, scenes and rays a host hands over. The only file that includes it.
#pragma once

#include <embree3/rtcore.h>  // IWYU pragma: export
