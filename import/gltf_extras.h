// SPDX-License-Identifier: Apache-2.0
// Files that nodes of a glTF file name in their extras. Internal to the room.
#pragma once

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"

namespace farfield {

inline tl::unexpected<Error> bad_extras(const char* key, const std::string& what) {
  return make_error(ErrorCode::BadFile, fmt::format("extras {}: {}", key, what));
}

/// What the extras `key` of a node say: the name of a file, relative to the scene's folder, or an object of which
/// read_property(object, property, named) takes one property after the other, "file" too; nothing if there are none.
/// Named: has a `file`. Errors: BadFile, one line without the node; those of read_property.
template <typename Named, typename ReadProperty>
Result<std::optional<Named>> file_of_extras(const tinygltf::Node& node, const char* key,
                                            const ReadProperty& read_property) {
  if (!node.extras.IsObject() || !node.extras.Has(key)) return std::nullopt;
  const tinygltf::Value& extras = node.extras.Get(key);
  Named named;
  if (extras.IsString()) {
    named.file = extras.Get<std::string>();
  } else if (extras.IsObject()) {
    for (const std::string& property : extras.Keys()) FARFIELD_TRY(read_property(extras, property, named));
  }
  if (named.file.empty()) return bad_extras(key, "names no file");
  if (std::filesystem::path(named.file).is_absolute()) {
    return bad_extras(key, "its file must be relative to the scene's folder");
  }
  return named;
}

}  // namespace farfield
