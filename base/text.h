// SPDX-License-Identifier: Apache-2.0
// Text as files have it, made fit to compare or to print.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

namespace farfield {

/// A to Z as a to z.
inline std::string lower_case(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

inline bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

/// With '?' for control characters, line breaks too.
inline std::string without_controls(std::string_view text) {
  std::string out(text);
  std::ranges::replace_if(out, is_control, '?');
  return out;
}

}  // namespace farfield
