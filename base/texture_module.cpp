// SPDX-License-Identifier: Apache-2.0
#include "base/texture_module.h"

#include "base/module_loader.h"

namespace farfield {

Result<const TextureModule*> load_texture_module(std::span<const std::filesystem::path> folders) {
  constexpr ModuleName kName{"farfield_textures.so", kTextureModuleEntry, "images cannot be read"};
  FARFIELD_TRY_LET(const void* entry, load_module(kName, folders));
  return static_cast<const TextureModule*>(entry);
}

Result<const TextureModule*> texture_module() {
  static const Result<const TextureModule*> module = load_texture_module(module_folders());
  return module;
}

}  // namespace farfield
