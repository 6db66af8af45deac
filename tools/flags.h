// SPDX-License-Identifier: Apache-2.0
// Flags whose values our own parsers read. Includes CLI11: only for the commands' .cpp files.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
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

/// SceneOptions::tile_triangles.
inline CLI::Option* add_tiles_flag(CLI::App* app, uint64_t& tile_triangles) {
  return app
      ->add_option("--tile-triangles", tile_triangles,
                   "Grounds (wide, flat and heavy) are baked as tiles of up to so many triangles; 0: whole")
      ->check(CLI::Range(uint64_t{0}, uint64_t{1} << 32))
      ->capture_default_str();
}

}  // namespace farfield::tool
