// SPDX-License-Identifier: Apache-2.0
// What a JSON parser's exception says, for people.
#pragma once

#include <string>
#include <string_view>

namespace farfield {

/// "its JSON is wrong at line 2, column 1: ..." for nlohmann's "[json.exception.parse_error.101] parse error at line 2,
/// column 1: ..."; other texts as they are, without a bracketed name in front.
inline std::string json_words(std::string_view exception) {
  if (exception.starts_with("[json.exception.")) {
    const size_t end = exception.find("] ");
    if (end != std::string_view::npos) exception.remove_prefix(end + 2);
  }
  constexpr std::string_view kParseError = "parse error at ";
  if (!exception.starts_with(kParseError)) return std::string(exception);
  return "its JSON is wrong at " + std::string(exception.substr(kParseError.size()));
}

}  // namespace farfield
