// SPDX-License-Identifier: Apache-2.0
// Parts of Farfield that bring many libraries with them are modules of their own, loaded by the first who needs one:
// what reads images (base/texture_module.h), what reads volumes (import/volume_module.h).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace farfield {

/// A module as messages and the loader name it.
struct ModuleName {
  const char* file;   ///< "farfield_textures.so"
  const char* entry;  ///< the symbol that it exports; a change of its type takes another name
  const char* use;    ///< "images cannot be read": what does not work without it
};

/// Where modules are looked for: FARFIELD_MODULE_DIR alone if it is set, else the places that the build tree and the
/// installation have them, as seen from the program or library that holds this code.
std::vector<std::filesystem::path> module_folders();

/// Loads the module from the first folder that has its file, and never unloads it; the address of its entry. Errors: Io
/// (it is missing, cannot be loaded or is of another version). Any thread.
Result<const void*> load_module(const ModuleName& name, std::span<const std::filesystem::path> folders);

}  // namespace farfield
