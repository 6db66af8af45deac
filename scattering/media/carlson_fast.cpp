// SPDX-License-Identifier: Apache-2.0
#include "scattering/media/carlson_fast.h"

#include <cmath>

namespace farfield {

float carlson_rg_fast(float x, float y, float z) {
  const float trace = x + y + z;
  if (!(trace > 0)) return 0;
  const float p = std::sqrt(x), q = std::sqrt(y), r = std::sqrt(z);
  const float power_sum = p * std::sqrt(p) + q * std::sqrt(q) + r * std::sqrt(r);
  const float power_mean = std::cbrt(power_sum * power_sum);
  // Fitted by minimax over all ratios of eigenvalues: docs/theory.md, section 2.
  return 0.0535084588f * trace / (p + q + r) - 0.0452450759f * (p * q * r) / trace + 0.4465581714f * power_mean +
         0.0326941186f * std::sqrt((x * y + y * z + z * x) / trace);
}

}  // namespace farfield
