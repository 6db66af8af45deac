// SPDX-License-Identifier: Apache-2.0
// Reads numbers and words from text in memory, without copies and without trusting it to end well.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

namespace farfield {

/// A position in a text. All readers skip blanks first and return false, moving nothing further, when what they want is
/// not there. Blanks are spaces, tabs and carriage returns; line ends are blanks only for whom asks.
class TextCursor {
 public:
  explicit TextCursor(std::string_view text) : at_(text.data()), end_(text.data() + text.size()) {}

  bool at_end() const { return at_ == end_; }
  char peek() const { return at_ == end_ ? '\0' : *at_; }
  void advance() { ++at_; }
  const char* position() const { return at_; }

  void skip_blanks() {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\t' || *at_ == '\r')) ++at_;
  }
  void skip_blanks_and_lines() {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\t' || *at_ == '\r' || *at_ == '\n')) ++at_;
  }
  /// The rest of the line without blanks at its ends; moves behind the line end.
  std::string_view rest_of_line() {
    skip_blanks();
    const char* begin = at_;
    while (at_ != end_ && *at_ != '\n') ++at_;
    const char* stop = at_;
    while (stop != begin && (stop[-1] == ' ' || stop[-1] == '\t' || stop[-1] == '\r')) --stop;
    if (at_ != end_) ++at_;
    return {begin, static_cast<size_t>(stop - begin)};
  }
  /// The next run of characters that are neither blank nor line end; empty at the end of the line.
  std::string_view word() {
    skip_blanks();
    const char* begin = at_;
    while (at_ != end_ && *at_ != ' ' && *at_ != '\t' && *at_ != '\r' && *at_ != '\n') ++at_;
    return {begin, static_cast<size_t>(at_ - begin)};
  }
  /// A decimal number, also nan, inf, with a plus sign; what overflows a double becomes infinite, what underflows 0.
  bool number(double& value) {
    skip_blanks();
    const char* begin = at_ != end_ && *at_ == '+' ? at_ + 1 : at_;
    const auto [stop, error] = std::from_chars(begin, end_, value);
    if (error == std::errc::invalid_argument) return false;
    if (error == std::errc::result_out_of_range) value = out_of_range_value(begin, stop);
    at_ = stop;
    return true;
  }
  /// An integer; one that does not fit 64 bits reads as the largest or smallest that does.
  bool integer(int64_t& value) {
    skip_blanks();
    const char* begin = at_ != end_ && *at_ == '+' ? at_ + 1 : at_;
    const auto [stop, error] = std::from_chars(begin, end_, value);
    if (error == std::errc::invalid_argument) return false;
    if (error == std::errc::result_out_of_range) {
      value = *begin == '-' ? std::numeric_limits<int64_t>::min() : std::numeric_limits<int64_t>::max();
    }
    at_ = stop;
    return true;
  }

 private:
  /// from_chars says neither which way a number is out of range nor its sign: a negative exponent means underflow.
  static double out_of_range_value(const char* begin, const char* stop) {
    const std::string_view text(begin, static_cast<size_t>(stop - begin));
    const size_t exponent = text.find_first_of("eE");
    const bool is_tiny = exponent != std::string_view::npos ? text.find('-', exponent) != std::string_view::npos
                                                            : text.find_first_not_of("-0.") > text.find('.');
    const double size = is_tiny ? 0.0 : std::numeric_limits<double>::infinity();
    return text.front() == '-' ? -size : size;
  }

  const char* at_;
  const char* end_;
};

/// UTF-8 text without the mark that some editors on Windows put first.
inline std::string_view without_byte_order_mark(std::string_view text) {
  return text.starts_with("\xef\xbb\xbf") ? text.substr(3) : text;
}

/// Text whose lines end as old Macs wrote them, \r alone, with ends that are read here. `storage` keeps what has
/// changed.
inline std::string_view with_line_ends(std::string_view text, std::string& storage) {
  if (text.find('\n') != std::string_view::npos || text.find('\r') == std::string_view::npos) return text;
  storage = text;
  std::replace(storage.begin(), storage.end(), '\r', '\n');
  return storage;
}

}  // namespace farfield
