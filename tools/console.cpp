// SPDX-License-Identifier: Apache-2.0
#include "tools/console.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <span>

#include "base/file_io.h"
#include "base/result.h"
#include "base/text.h"

namespace farfield::tool {
namespace fs = std::filesystem;

bool stdout_is_terminal() { return isatty(STDOUT_FILENO) == 1; }

void print_warnings(std::string_view command, const std::vector<std::string>& warnings, size_t shown) {
  for (size_t i = 0; i < std::min(shown, warnings.size()); ++i)
    fmt::print(stderr, "farfield {}: warning: {}\n", command, one_line(warnings[i]));
  if (warnings.size() > shown)
    fmt::print(stderr, "farfield {}: warning: and {} more of the kind\n", command, warnings.size() - shown);
}

std::string one_line(std::string_view text) {
  while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
  std::string line;
  for (const char c : text) {
    if (c == '\n')
      line += "; ";
    else
      line += is_control(c) ? '?' : c;
  }
  return line;
}

std::string format_table(const std::vector<std::vector<std::string>>& rows) {
  std::vector<size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (size_t column = 0; column < row.size(); ++column)
      widths[column] = std::max(widths[column], row[column].size());
  }
  std::string text;
  for (const auto& row : rows) {
    for (size_t column = 0; column < row.size(); ++column)
      text += fmt::format("{}{:>{}}", column == 0 ? "" : "  ", row[column], widths[column]);
    text += '\n';
  }
  return text;
}

namespace {

/// Exists and is neither a file nor a folder: /dev/stdout, a pipe. Never to be replaced by renaming a file onto it.
bool is_stream(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

Result<void> write_to_stream(const fs::path& path, std::string_view text) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  const bool written = file && std::fwrite(text.data(), 1, text.size(), file) == text.size();
  if (file && std::fclose(file) == 0 && written) return {};
  return make_error(ErrorCode::Io, fmt::format("{}: cannot write: {}", path.string(), std::strerror(errno)));
}

bool is_same_place(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error);
}

Result<void> check_extension(const fs::path& path, Output output) {
  const char* expected = output == Output::Exr ? ".exr" : ".png";
  if (output == Output::Text || output == Output::File || path.extension() == expected) return {};
  return make_error(ErrorCode::InvalidArgument,
                    fmt::format("{}: the file that is written here must be named {}", path.string(), expected));
}

Result<void> check_keeps(const fs::path& path, const std::vector<fs::path>& inputs) {
  for (const fs::path& input : inputs) {
    if (input.empty()) continue;
    if (is_same_place(path, input)) {
      return make_error(ErrorCode::InvalidArgument,
                        fmt::format("{}: is read here; write to another file", path.string()));
    }
    if (is_same_place(fs::absolute(path).parent_path(), input)) {
      return make_error(ErrorCode::InvalidArgument, fmt::format("{}: {} holds a baked asset and nothing else; write to "
                                                                "another folder",
                                                                path.string(), input.string()));
    }
  }
  return {};
}

}  // namespace

Result<void> check_can_write(const fs::path& path, Output output, const std::vector<fs::path>& inputs) {
  if (path.empty() || (output == Output::Text && is_stream(path))) return {};
  FARFIELD_TRY(check_extension(path, output));
  FARFIELD_TRY(check_keeps(path, inputs));
  const auto refuse = [&](std::string_view reason) {
    return make_error(ErrorCode::Io, fmt::format("{}: cannot write: {}", path.string(), reason));
  };
  std::error_code error;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error)) return refuse(fmt::format("there is no folder {}", folder.string()));
  if (fs::is_directory(path, error)) return refuse("this is a folder");
  if (is_stream(path)) return refuse("this is not a regular file");
  if (access(folder.c_str(), W_OK) != 0) return refuse(std::strerror(errno));
  return {};
}

Result<void> write_text_file(const fs::path& path, std::string_view text) {
  if (is_stream(path)) return write_to_stream(path, text);
  const auto bytes = std::as_bytes(std::span(text));
  return write_file_atomically(path, {&bytes, 1});
}

}  // namespace farfield::tool
