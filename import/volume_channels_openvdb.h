// SPDX-License-Identifier: Apache-2.0
// What an OpenVDB file says of voxels besides their densities: albedos, phase functions, ellipsoids of SGGX, directions
// of fibres, and all that the flakes of an exported level have. docs/scene_format.md has the names. Part of the module.
#pragma once

#include <openvdb/openvdb.h>

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "base/result.h"
#include "import/fog_options.h"
#include "import/source_volume.h"

namespace farfield {

/// "(1, 2, 3)".
std::string coordinate_text(const openvdb::Coord& c);

struct VdbChannels {
  const std::string& path;
  const FogOptions& options;
  const std::function<openvdb::GridBase::Ptr(const std::string& name)>& load;  ///< a grid with its voxels
  const std::vector<openvdb::GridBase::Ptr>& grids;                            ///< all of the file's, without voxels
  const openvdb::GridBase& density;                                            ///< the chosen one of these
  openvdb::Coord first_voxel;                                                  ///< of the volume, in the file's lattice
  bool is_paged;  ///< load() gives grids whose leaves may go once looked at
};

/// Adds to a volume whose densities and rotation are known what else the file has on its lattice; where there are
/// shapes, densities become theirs. Puts the names of the grids that it knows into `used`. Errors: BadFile (values that
/// are no numbers, with the first such voxel), Unsupported (another lattice, half of a pair).
Result<void> read_channels(const VdbChannels& from, SourceVolume& volume, std::set<std::string>& used);

}  // namespace farfield
