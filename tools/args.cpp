// SPDX-License-Identifier: Apache-2.0
#include "tools/args.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <utility>

#include "base/bytes.h"

namespace farfield::tool {
namespace {

constexpr int kHighestLevel = 1000;

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

Result<PixelPlace> parse_pixel_place(std::string_view text) {
  const auto place = read_pair(text, ',', 0, 65535);
  if (!place) return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is not a pixel such as 320,180", text));
  return PixelPlace{place->first, place->second};
}

Result<uint64_t> parse_budget(std::string_view text) {
  const auto bytes = parse_bytes(text);
  if (bytes && *bytes == 0) return make_error(ErrorCode::InvalidArgument, "nothing fits 0 bytes");
  return bytes;
}

Result<float> parse_pixel_error(std::string_view text) {
  float pixels = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), pixels);
  const bool is_number = error == std::errc() && end == text.data() + text.size();
  if (is_number && pixels > 0 && pixels <= 1e6f) return pixels;  // NaN is not
  return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is not a number above 0, at most 1e6", text));
}

Result<uint32_t> parse_finest_grid(std::string_view text) {
  const auto grid = read_number(text, 8, 1 << 16);
  if (grid && (*grid & (*grid - 1)) == 0) return static_cast<uint32_t>(*grid);
  return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is not a power of two from 8", text));
}

Result<uint32_t> parse_rays_per_voxel(std::string_view text) {
  if (const auto rays = read_number(text, 1, 1000000)) return static_cast<uint32_t>(*rays);
  return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is not a number from 1 to 1000000", text));
}

Result<Part> parse_part(std::string_view text) {
  const auto part = read_pair(text, '/', 0, 1000000);
  if (part && part->first < part->second)
    return Part{static_cast<uint32_t>(part->first), static_cast<uint32_t>(part->second)};
  return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is not a part such as 0/8 to 7/8", text));
}

Result<std::optional<vec3>> parse_albedo(std::string_view text) {
  vec3 albedo(0.0f);
  int count = 0;
  for (std::string_view rest = text; count < 3; ++count) {
    const size_t comma = std::min(rest.find(','), rest.size());
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + comma, albedo[count]);
    if (error != std::errc() || end != rest.data() + comma || !(albedo[count] >= 0 && albedo[count] <= 1)) break;
    if (comma == rest.size()) {
      if (count == 0) return vec3(albedo.x);
      if (count == 2) return albedo;
      break;
    }
    rest.remove_prefix(comma + 1);
  }
  return make_error(ErrorCode::InvalidArgument,
                    fmt::format("\"{}\" is not one number in [0, 1], or three with commas between them", text));
}

tl::unexpected<Error> is_there_twice(std::string_view value) {
  return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is there twice", value));
}

Result<LevelRange> parse_level_range(std::string_view text) {
  if (const auto level = read_number(text, 0, kHighestLevel))
    return LevelRange{static_cast<uint32_t>(*level), static_cast<uint32_t>(*level)};
  const auto range = read_pair(text, '-', 0, kHighestLevel);
  if (!range || range->first > range->second)
    return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is not a range of levels such as 2-5", text));
  return LevelRange{static_cast<uint32_t>(range->first), static_cast<uint32_t>(range->second)};
}

Result<std::vector<uint32_t>> parse_levels(std::string_view text) {
  if (text == "all") return std::vector<uint32_t>();
  return parse_list<uint32_t>(text, [](std::string_view word) -> Result<uint32_t> {
    if (const auto level = read_number(word, 0, kHighestLevel)) return static_cast<uint32_t>(*level);
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("\"{}\" is not a level's number; levels are a list such as 2,3, or all", word));
  });
}

}  // namespace farfield::tool
