// SPDX-License-Identifier: Apache-2.0
// Values of command line flags that are more than one number.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/vec.h"

namespace farfield::tool {

struct PixelSize {
  int width = 0, height = 0;
};
/// Reads "640x360"; both in [1, 65536]. Errors: InvalidArgument.
Result<PixelSize> parse_pixel_size(std::string_view text);

struct PixelPlace {
  int x = 0, y = 0;
};
/// Reads "320,180"; both in [0, 65535]. Errors: InvalidArgument.
Result<PixelPlace> parse_pixel_place(std::string_view text);

/// Reads a size as parse_bytes() does, but not 0. Errors: InvalidArgument.
Result<uint64_t> parse_budget(std::string_view text);
/// Reads a number above 0, at most 1e6. Errors: InvalidArgument.
Result<float> parse_pixel_error(std::string_view text);
/// Reads a power of two in [8, 65536]. Errors: InvalidArgument.
Result<uint32_t> parse_finest_grid(std::string_view text);
/// Reads a number in [1, 1000000]. Errors: InvalidArgument.
Result<uint32_t> parse_rays_per_voxel(std::string_view text);

struct Part {
  uint32_t number = 0, count = 1;
};
/// Reads "3/8": number < count, count in [1, 1000000]. Errors: InvalidArgument.
Result<Part> parse_part(std::string_view text);

/// The error for a value that a list has again.
tl::unexpected<Error> is_there_twice(std::string_view value);
/// Reads values with commas between them, each by `parse` and none twice: "1,0.5,2". Errors: those of `parse`,
/// InvalidArgument.
template <typename T>
Result<std::vector<T>> parse_list(std::string_view text, Result<T> (*parse)(std::string_view)) {
  std::vector<T> values;
  while (true) {
    const size_t comma = text.find(',');
    const Result<T> value = parse(text.substr(0, comma));
    if (!value) return tl::unexpected(value.error());
    if (std::find(values.begin(), values.end(), *value) != values.end()) return is_there_twice(text.substr(0, comma));
    values.push_back(*value);
    if (comma == std::string_view::npos) return values;
    text.remove_prefix(comma + 1);
  }
}

/// Reads "0.9" or "0.9,0.8,0.7"; each in [0, 1]. Errors: InvalidArgument.
Result<std::optional<vec3>> parse_albedo(std::string_view text);

struct LevelRange {
  uint32_t first = 0, last = 0;
};
/// Reads "2-5" or "3"; both in [0, 1000], first <= last. Errors: InvalidArgument.
Result<LevelRange> parse_level_range(std::string_view text);

/// Reads "3", "0,2,5" or "all", which is no list; each in [0, 1000], none twice. Errors: InvalidArgument.
Result<std::vector<uint32_t>> parse_levels(std::string_view text);

}  // namespace farfield::tool
