// SPDX-License-Identifier: Apache-2.0
#include "tools/args.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <utility>

namespace farfield::tool {
namespace {

/// All of `text` as a decimal number in [lowest, highest]: digits only.
std::optional<int> read_number(std::string_view text, int lowest, int highest) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < lowest || value > highest) return {};
  return value;
}

/// "A<separator>B" as two numbers.
std::optional<std::pair<int, int>> read_pair(std::string_view text, char separator, int lowest, int highest) {
  const size_t split = text.find(separator);
  if (split == std::string_view::npos) return {};
  const auto a = read_number(text.substr(0, split), lowest, highest);
  const auto b = read_number(text.substr(split + 1), lowest, highest);
  if (!a || !b) return {};
  return std::pair(*a, *b);
}

}  // namespace

Result<PixelSize> parse_pixel_size(std::string_view text) {
  const auto size = read_pair(text, 'x', 1, 65536);
  if (!size) return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is not a size such as 640x360", text));
  return PixelSize{size->first, size->second};
}

Result<LevelRange> parse_level_range(std::string_view text) {
  constexpr int kHighest = 1000;
  if (const auto level = read_number(text, 0, kHighest))
    return LevelRange{static_cast<uint32_t>(*level), static_cast<uint32_t>(*level)};
  const auto range = read_pair(text, '-', 0, kHighest);
  if (!range || range->first > range->second)
    return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is not a range of levels such as 2-5", text));
  return LevelRange{static_cast<uint32_t>(range->first), static_cast<uint32_t>(range->second)};
}

}  // namespace farfield::tool
