// SPDX-License-Identifier: Apache-2.0
// The transfer function of sRGB [IEC 1999], for what is written; import/texture.h has its inverse.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace farfield {

/// A linear value as a byte; clamped to [0, 1], NaN is 0.
inline uint8_t srgb_byte(float linear) {
  const float x = linear > 0 ? std::min(linear, 1.0f) : 0.0f;
  const float encoded = x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
  return static_cast<uint8_t>(255.0f * encoded + 0.5f);
}

}  // namespace farfield
