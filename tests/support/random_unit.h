// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "base/vec.h"

namespace farfield::test {

/// Uniform on the sphere.
inline vec3 random_unit(Rng& rng) {
  const float z = 2.0f * rng.next() - 1.0f, phi = 2.0f * kPi * rng.next();
  const float radius = std::sqrt(std::max(0.0f, 1.0f - z * z));
  return {radius * std::cos(phi), radius * std::sin(phi), z};
}

}  // namespace farfield::test
