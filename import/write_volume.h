// SPDX-License-Identifier: Apache-2.0
// Writing OpenVDB files (.vdb): grids of values at the voxels of bricks. It knows nothing of levels, nor of OpenVDB,
// which is behind the door of volume_module.h.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "base/vec.h"

namespace farfield {

/// Where grids have values: which voxels of which blocks of 8^3. Blocks are sorted by nothing, each is there once.
struct VolumeBlocks {
  glm::dmat4 index_to_source{1.0};                ///< of voxel *centres*, as OpenVDB has them; may turn and mirror
  std::vector<ivec3> blocks;                      ///< coordinates, in blocks: voxel (0, 0, 0) of it is 8 times that
  std::vector<std::array<uint64_t, 8>> is_there;  ///< bit i % 64 of word i / 64: voxel i, x fastest, then y, then z
};

using GridMetadataValue = std::variant<std::string, int64_t, double, dvec3>;
using GridMetadata = std::vector<std::pair<std::string, GridMetadataValue>>;

struct VolumeGrid {
  enum class Kind {
    Density,  ///< float, of the class of fog volumes
    Scalar,   ///< float
    Vector,   ///< three floats, which a transform does not turn
    Integer,  ///< int32
  };
  std::string name;
  Kind kind = Kind::Scalar;
  std::shared_ptr<const VolumeBlocks> lattice;
  GridMetadata metadata;
  /// Writes the values of a block, x fastest, of a Vector three per voxel; those of voxels that are not there do not
  /// matter. Called for each block, from one thread.
  std::function<void(size_t block, std::span<float> values)> fill;
};

struct VolumeFile {
  std::vector<VolumeGrid> grids;  ///< in this order; names differ
  GridMetadata metadata;          ///< of the file
  uint64_t content_hash = 0;      ///< what makes the file another one; OpenVDB's readers want files to have a mark
};

/// Writes the file, whole or not at all; the same grids give the same bytes. One grid at a time is in memory, 2 KiB per
/// block and value. Any thread. Errors: Io (disk, permissions, the module is missing), OutOfBudget (no memory),
/// Cancelled.
Result<void> write_volume(const std::filesystem::path& path, const VolumeFile& file, const Job& job = {});

}  // namespace farfield
