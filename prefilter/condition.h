// SPDX-License-Identifier: Apache-2.0
// Surface conditioning: what a file says becomes one Surface with a material per face.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "import/read_source.h"
#include "prefilter/surface.h"

namespace farfield {

/// Goes up when condition() gives other results.
inline constexpr uint32_t kConditionVersion = 2;

struct ImportedAsset {
  Surface surface;
  uint64_t source_hash = 0;              ///< of the file's bytes, of the files it refers to, and of ImportOptions
  std::vector<HashedFile> source_files;  ///< that it refers to, relative to its folder
  std::vector<std::string> warnings;     ///< one line each: dropped faces, missing textures, ignored features
};

/// Polygons are triangulated (quads along the diagonal that lies inside, the shorter of two; concave ones correctly),
/// vertices that share a position up to rounding are welded, triangles that coincide are kept once, textures are
/// averaged over each face, alpha-masked faces are cut along the mask's outline, degenerate and NaN faces are dropped
/// with a warning. What materials become is written in docs/decisions/0006. `name` is for messages; the job is polled
/// for every mask that is cut. Errors: Cancelled; BadFile (no face with area is left), Unsupported (a longest side
/// outside [1e-6, 1e9], which single precision cannot work in).
Result<ImportedAsset> condition(SourceMesh mesh, const std::string& name, const Job& job = {});

/// read_source() and condition(). Errors: those of both.
Result<ImportedAsset> import_asset(const std::filesystem::path& path, const ImportOptions& options = {},
                                   const Job& job = {});

}  // namespace farfield
