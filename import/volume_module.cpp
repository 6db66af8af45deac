// SPDX-License-Identifier: Apache-2.0
#include "import/volume_module.h"

#include "base/module_loader.h"

namespace farfield {

Result<const VolumeModule*> volume_module() {
  static const Result<const void*> entry = [] {
    constexpr ModuleName kName{"farfield_volumes.so", kVolumeModuleEntry, "volumes can be neither read nor written"};
    return load_module(kName, module_folders());
  }();
  if (!entry) return tl::unexpected(entry.error());
  return static_cast<const VolumeModule*>(*entry);
}

}  // namespace farfield
