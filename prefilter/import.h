// SPDX-License-Identifier: Apache-2.0
// Reading assets: OBJ + MTL, PLY, glTF / glb, each also gzipped, to one Surface with a material per face.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "prefilter/surface.h"

namespace farfield {

struct ImportOptions {
  int mesh =
      -1;  ///< glTF only: import this mesh alone, in its own space; -1: all nodes of the default scene, flattened
};

struct ImportedAsset {
  Surface surface;
  uint64_t source_hash = 0;           ///< of the file's bytes, of the files it refers to, and of ImportOptions
  std::vector<std::string> warnings;  ///< one line each: dropped faces, missing textures, ignored features
};

/// Reads one asset. Polygons are triangulated (quads along the diagonal that lies inside, the shorter of two; concave
/// ones correctly), vertices that share a position up to rounding are welded, triangles that coincide are kept once,
/// textures are averaged over each face, alpha-masked faces are cut along the mask's outline, degenerate and NaN faces
/// are dropped with a warning. What materials become is written in docs/decisions/0006. Anything that leaves no face
/// with area is an error, and so is a longest side outside [1e-6, 1e9], which single precision cannot work in.
/// Errors: NotFound, Io, BadFile, Unsupported, InvalidArgument (no such mesh): one line that names the file, the place
/// and the remedy. Never crashes on bad files.
Result<ImportedAsset> import_asset(const std::filesystem::path& path, const ImportOptions& options = {});

}  // namespace farfield
