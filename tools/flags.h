// SPDX-License-Identifier: Apache-2.0
// Flags whose values our own parsers read. Includes CLI11: only for the commands' .cpp files.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "base/result.h"

namespace farfield::tool {

/// Checks of an option's text, as CLI11 wants them: what is wrong, or nothing.
inline std::string is_named(const std::string& text) { return text.empty() ? "the name is empty" : ""; }

/// An option that `parse` (text -> Result<T>) reads into `target`; what it refuses is an error that names the flag.
template <typename T, typename Parse>
CLI::Option* add_parsed_option(CLI::App* app, const std::string& flag, T& target, Parse parse,
                               const std::string& help) {
  const auto read = [&target, parse, flag](const std::string& text) {
    auto value = parse(text);
    if (!value) throw CLI::ValidationError(flag, value.error().message);
    target = *value;
  };
  return app->add_option_function<std::string>(flag, read, help);
}

/// SceneOptions::tiles.
inline CLI::Option* add_tiles_flag(CLI::App* app, bool& tiles) {
  return app->add_flag("!--no-tiles", tiles, "Keep grounds whole: do not bake what is wide and flat as tiles");
}

}  // namespace farfield::tool
