// SPDX-License-Identifier: Apache-2.0
#include "import/write_volume.h"

#include "import/volume_module.h"

namespace farfield {

Result<void> write_volume(const std::filesystem::path& path, const VolumeFile& file, const Job& job) {
  FARFIELD_TRY_LET(const VolumeModule* module, volume_module());
  return module->write(path.string(), file, job);
}

}  // namespace farfield
