// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/hash.h"
#include "base/split_mix.h"
#include "base/vec.h"
#include "scattering/warp.h"

namespace farfield {

/// Cosine distributed around a unit normal.
inline vec3 random_lobe(const vec3& normal, SplitMix& random) {
  const float u1 = to_unit_float(random.next()), u2 = to_unit_float(random.next());
  return cosine_lobe(normal, u1, u2);
}

}  // namespace farfield
