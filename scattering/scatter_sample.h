// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/vec.h"

namespace farfield {

/// A sampled direction. weight = f |cos| / pdf (surfaces) or albedo * phase / pdf (volumes); zero: failed sample.
struct ScatterResult {
  vec3 wi{0.0f};
  vec3 weight{0.0f};
  float pdf = 0;
};

}  // namespace farfield
