// SPDX-License-Identifier: Apache-2.0
#include "base/module_loader.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <link.h>

#include <cstdlib>
#include <system_error>

namespace farfield {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepestBelowPrefix = 4;  // lib/python3/dist-packages/farfield
constexpr const char* kFolderVariable = "FARFIELD_MODULE_DIR";

/// The folder of the program or the shared library that this code was linked into; empty if the system does not say.
fs::path folder_of_this_code() {
  Dl_info info{};
  void* map = nullptr;
  const auto* code = reinterpret_cast<const void*>(&folder_of_this_code);
  if (dladdr1(code, &info, &map, RTLD_DL_LINKMAP) == 0) return {};
  const std::string library = static_cast<const link_map*>(map)->l_name;
  std::error_code failure;
  // The program itself has no name there, and dladdr would tell how it was called, not where it is.
  const fs::path file = fs::canonical(library.empty() ? "/proc/self/exe" : library, failure);
  return failure ? fs::path() : file.parent_path();
}

}  // namespace

std::vector<fs::path> module_folders() {
  if (const char* folder = std::getenv(kFolderVariable); folder && *folder) return {folder};
  const fs::path here = folder_of_this_code();
  if (here.empty()) return {};
  // From the folder of libraries; then from those of programs and of Python modules, which lie deeper.
  std::vector<fs::path> folders = {here / "farfield"};
  fs::path prefix = here;
  for (int up = 0; up < kDeepestBelowPrefix; ++up) {
    prefix = prefix.parent_path();
    folders.push_back(prefix / FARFIELD_LIBRARY_FOLDER / "farfield");
  }
  return folders;
}

Result<const void*> load_module(const ModuleName& name, std::span<const fs::path> folders) {
  const auto cannot_load = [&](const std::string& why) {
    return make_error(ErrorCode::Io,
                      fmt::format("{}: {}, or set {} to the folder of another one", name.use, why, kFolderVariable));
  };
  std::string tried;
  for (const fs::path& folder : folders) {
    const fs::path file = folder / name.file;
    tried += fmt::format("{}{}", tried.empty() ? "" : " or ", file.string());
    std::error_code ignored;
    if (!fs::exists(file, ignored)) continue;
    void* module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);  // never closed: its libraries keep threads
    if (!module) return cannot_load(fmt::format("{}; install what it needs", dlerror()));
    if (const void* entry = dlsym(module, name.entry)) return entry;
    return cannot_load(fmt::format("{} is of another version; install that of this one", file.string()));
  }
  return cannot_load(fmt::format("there is no {}; install it there", tried.empty() ? name.file : tried));
}

}  // namespace farfield
