// SPDX-License-Identifier: Apache-2.0
#include "base/bytes.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <charconv>

namespace farfield {

std::string format_bytes(uint64_t bytes) {
  if (bytes < 1024) return fmt::format("{} B", bytes);
  constexpr std::array units = {"KiB", "MiB", "GiB", "TiB"};
  double value = static_cast<double>(bytes) / 1024.0;
  size_t unit = 0;
  while (value >= 1024.0 && unit + 1 < units.size()) {
    value /= 1024.0;
    ++unit;
  }
  return fmt::format("{:.2f} {}", value, units[unit]);
}

Result<uint64_t> parse_bytes(std::string_view text) {
  const auto bad = [&] {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("'{}' is not a size; write for example 512M or 4G", text));
  };
  double value = 0.0;
  const auto [rest, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc() || !(value >= 0.0)) return bad();

  std::string unit;
  const char* const end = text.data() + text.size();
  const bool has_blank = end - rest > 1 && *rest == ' ';  // as format_bytes() writes it
  for (const char* c = rest + has_blank; c != end; ++c) {
    unit += static_cast<char>(std::tolower(static_cast<unsigned char>(*c)));
  }
  if (unit.ends_with("ib")) {
    unit.resize(unit.size() - 2);
  } else if (unit.ends_with("b")) {
    unit.resize(unit.size() - 1);
  }
  constexpr std::string_view kUnits = "kmgt";
  if (unit.size() > 1) return bad();
  if (unit.size() == 1) {
    const size_t power = kUnits.find(unit[0]);
    if (power == std::string_view::npos) return bad();
    for (size_t i = 0; i <= power; ++i) value *= 1024.0;
  }
  if (!(value < 0x1p62)) return bad();
  return static_cast<uint64_t>(value);
}

}  // namespace farfield
