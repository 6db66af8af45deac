// SPDX-License-Identifier: Apache-2.0
// `farfield export`: levels of a baked asset as files that other programs read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/job.h"
#include "base/result.h"

namespace farfield {

/// What a level becomes. A level may have a surface and a volume; a file holds one of them.
enum class ExportFormat {
  Vdb,  ///< its volume, as OpenVDB grids
  Obj,  ///< its surface, with an .mtl beside it
  Ply,
  Glb,
};

/// By the ending of the name, in upper or lower case. Errors: InvalidArgument.
Result<ExportFormat> export_format_of(const std::filesystem::path& path);

/// All files that an export to `target` writes: an .obj has its .mtl.
std::vector<std::filesystem::path> files_of_export(const std::filesystem::path& target);

struct ExportOptions {
  std::vector<uint32_t> levels;  ///< empty: all that have what the format holds. Surfaces: one
};

struct ExportedLevel {
  uint32_t level = 0;
  double resolution = 0;                            ///< r_k, length units of the source
  uint64_t faces = 0, vertices = 0, materials = 0;  ///< of a surface, as written
  uint64_t voxels = 0;                              ///< of a volume
  std::vector<std::string> grids = {};              ///< names of the volume's
};

struct ExportReport {
  std::vector<ExportedLevel> levels;
  std::vector<std::string> notes;  ///< one line each: what the format cannot hold, and what became of it
};

/// Writes levels of `asset` to `target`, whole or not at all, in the source's space and units. The same asset gives the
/// same bytes. Any thread. Errors: those of read_manifest() and LevelFile::open_known() (levels are not trusted);
/// InvalidArgument (unknown ending, no such level, several surfaces for one file, a level without what the format
/// holds); Unsupported (too large for the format); Io; Cancelled.
Result<ExportReport> export_asset(const std::filesystem::path& asset, const std::filesystem::path& target,
                                  const ExportOptions& options, const Job& job = {});

}  // namespace farfield
