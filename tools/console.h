// SPDX-License-Identifier: Apache-2.0
// What the commands have in common when they talk: tables, messages, files.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace farfield::tool {

/// True if a person reads standard output. In a pipe commands print only what they were asked for.
bool stdout_is_terminal();

/// "farfield bake: warning: ...": each warning on a line of standard error, at most `shown` of them; --report and
/// --json have them all.
void print_warnings(std::string_view command, const std::vector<std::string>& warnings, size_t shown = 5);

/// The text with line breaks and other control characters made visible, so that it stays one line on the terminal.
std::string one_line(std::string_view text);

/// Rows of equal length; the first is the head. Columns as wide as their widest cell, right-aligned, two blanks apart.
std::string format_table(const std::vector<std::vector<std::string>>& rows);

/// Text may also go to /dev/stdout or a pipe; the rest are files, pictures named .exr or .png.
enum class Output { Text, File, Exr, Png };

/// Fails at once when `path` cannot become a file (its folder does not exist or may not be written, it is a folder, or
/// its name is that of another kind), so that long jobs do not end that way; and when it would replace one of `inputs`
/// or lie in a folder that is one. Empty paths are fine. Errors: Io, InvalidArgument.
Result<void> check_can_write(const std::filesystem::path& path, Output output,
                             const std::vector<std::filesystem::path>& inputs = {});

/// Writes the whole file, by way of a temporary name, or into the stream that `path` is. Errors: Io.
Result<void> write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace farfield::tool
