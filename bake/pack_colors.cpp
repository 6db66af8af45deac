// SPDX-License-Identifier: Apache-2.0
#include "bake/pack_colors.h"

namespace farfield {

PackedColor ColorRounder::operator()(const vec3& linear_rgb) {
  PackedColor packed = pack_color(linear_rgb);
  const vec3 nearest = unpack_color(packed);
  for (int i = 0; i < 3; ++i) {
    const float wanted = linear_rgb[i], lost = wanted - nearest[i];
    if (!(wanted > 0 && wanted < 1) || lost == 0) continue;
    uint8_t& code = packed.sqrt_rgb[static_cast<size_t>(i)];
    PackedColor other = packed;
    other.sqrt_rgb[static_cast<size_t>(i)] = static_cast<uint8_t>(lost > 0 ? code + 1 : code - 1);
    const float lost_by_other = wanted - unpack_color(other)[i];
    if (std::abs(owed_[i] + lost_by_other) < std::abs(owed_[i] + lost)) {
      code = other.sqrt_rgb[static_cast<size_t>(i)];
      owed_[i] += lost_by_other;
    } else {
      owed_[i] += lost;
    }
    // Light elements do not pay for what dark ones cannot: at most one step of this one is owed on.
    const float step = std::abs(lost) + std::abs(lost_by_other);
    owed_[i] = std::clamp(owed_[i], -step, step);
  }
  return packed;
}

}  // namespace farfield
