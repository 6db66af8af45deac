// SPDX-License-Identifier: Apache-2.0
// A level's surface as files of other programs. Internal to the room.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "export/exported_level.h"

namespace farfield {

struct WrittenSurface {
  uint64_t faces = 0, vertices = 0, materials = 0;
  std::vector<std::string> notes;  ///< what the format cannot hold, without the level's name
};

/// All write their files whole or not at all, of a level that has a surface. Errors: Io, Unsupported (too large),
/// Cancelled.
///
/// Everything that a face has, as properties of faces: colour as sRGB bytes, the rest as linear floats.
Result<WrittenSurface> write_ply(const std::filesystem::path& path, const LevelOfAsset& from, const Job& job);
/// Faces in groups of one material (material_groups.h); `path` with the ending .mtl has those.
Result<WrittenSurface> write_obj(const std::filesystem::path& path, const LevelOfAsset& from, const Job& job);
/// Base colour and opacity at corners (COLOR_0), the rest as materials of groups.
Result<WrittenSurface> write_glb(const std::filesystem::path& path, const LevelOfAsset& from, const Job& job);

/// A note: see face_looks.h.
inline constexpr const char* kNormalsInRoughness =
    "how normals spread within faces is only in roughness; a .ply has it as it is";

/// "level_3_17": the material of a group of faces.
std::string group_name(const LevelOfAsset& from, size_t group);

std::filesystem::path mtl_of(const std::filesystem::path& obj);

}  // namespace farfield
