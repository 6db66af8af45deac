// SPDX-License-Identifier: Apache-2.0
// The border to the module that reads and writes volumes: OpenVDB and the libraries that come with it are for those who
// have one. Internal to the room.
#pragma once

#include <string>

#include "base/job.h"
#include "base/result.h"
#include "import/read_volume.h"
#include "import/voxel_shape.h"
#include "import/write_volume.h"

namespace farfield {

/// A file's grid as it is: voxels of `volume` have the shape `shape`, whose size and rotation it has.
struct VolumeOnLattice {
  SourceVolume volume;
  VoxelShape shape;
};

/// What the module exports, under the name kVolumeModuleEntry. All from any thread; errors as read_volume() has them,
/// but for options, which are right, and without the hash, and as write_volume() has them.
struct VolumeModule {
  Result<VolumeExtent> (*read_extent)(const std::string& path, const FogOptions& options);
  Result<VolumeOnLattice> (*read)(const std::string& path, const FogOptions& options, const Job& job);
  Result<void> (*write)(const std::string& path, const VolumeFile& file, const Job& job);
};

/// A change of the types above, or of those that they name, takes the next number.
inline constexpr const char* kVolumeModuleEntry = "farfield_volume_module_4";

/// The module, loaded at the first call and never unloaded. Any thread. Errors: Io (it is missing or cannot be loaded;
/// later calls say the same).
Result<const VolumeModule*> volume_module();

}  // namespace farfield
