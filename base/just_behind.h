// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>

namespace farfield {

/// Where a ray from `near` on that passed a hit at `distance` goes on: beyond both, so that it gets somewhere. Kernels
/// of Embree test hits before they divide: one in a thousand of those that lie on `near` is reported an ulp in front of
/// it. Threads that trace take denormal numbers for 0: those are left out. Not NaN. Any thread.
inline float just_behind(float near, float distance) {
  const float next = std::nextafter(std::max(near, distance), std::numeric_limits<float>::infinity());
  return std::abs(next) < FLT_MIN ? FLT_MIN : next;
}

}  // namespace farfield
