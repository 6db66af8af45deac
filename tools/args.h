// SPDX-License-Identifier: Apache-2.0
// Values of command line flags that are more than one number.
#pragma once

#include <cstdint>
#include <string_view>

#include "base/result.h"

namespace farfield::tool {

struct PixelSize {
  int width = 0, height = 0;
};
/// Reads "640x360"; both in [1, 65536]. Errors: InvalidArgument.
Result<PixelSize> parse_pixel_size(std::string_view text);

struct LevelRange {
  uint32_t first = 0, last = 0;
};
/// Reads "2-5" or "3"; both in [0, 1000], first <= last. Errors: InvalidArgument.
Result<LevelRange> parse_level_range(std::string_view text);

}  // namespace farfield::tool
