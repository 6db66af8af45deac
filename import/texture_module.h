// SPDX-License-Identifier: Apache-2.0
// The border between the readers and the module that decodes images. OpenImageIO brings 250 libraries, 130 MiB and a
// quarter of a second with it: they are for those who read an image, so the module is loaded by the first of them.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace farfield {

/// An image as its file stores it: no colour space, no alpha applied.
struct DecodedImage {
  int width = 0, height = 0;
  int channels = 0;           ///< at most 4
  int alpha_channel = -1;     ///< -1 if there is none
  bool is_float = false;      ///< the file stores floats; integers are scaled to [0, 1]
  std::vector<float> values;  ///< width * height * channels, row by row from the top
};

/// What the module exports, under the name kTextureModuleEntry. Both from any thread. `name` is for messages. Errors:
/// BadFile, Unsupported (too large, unknown format).
struct TextureModule {
  Result<DecodedImage> (*read_file)(const std::string& path);
  Result<DecodedImage> (*decode)(std::span<const unsigned char> bytes, const std::string& name);
};

/// A change of the types above takes the next number: a module of another version is then refused, not misread.
inline constexpr const char* kTextureModuleEntry = "farfield_texture_module_1";

/// The module, loaded at the first call and never unloaded. Any thread. Errors: Io (it is missing or cannot be loaded;
/// later calls say the same).
Result<const TextureModule*> texture_module();

/// Where texture_module looks: FARFIELD_MODULE_DIR alone if it is set, else the places that the build tree and the
/// installation have it, as seen from the program or library that holds this code.
std::vector<std::filesystem::path> texture_module_folders();

/// Loads the module from the first folder that has its file. Errors: Io.
Result<const TextureModule*> load_texture_module(std::span<const std::filesystem::path> folders);

}  // namespace farfield
