// SPDX-License-Identifier: Apache-2.0
// One reader per file format. Each checks every index and count that it hands on, and drops or refuses what is broken.
#pragma once

#include <filesystem>
#include <span>

#include "import/source_mesh.h"

namespace farfield {

/// `bytes` is the (unpacked) content; `path` is for messages and for finding the files that the content refers to.
/// Positions may still be infinite or NaN, polygons degenerate. Errors: BadFile, Unsupported.
Result<SourceMesh> read_obj(std::span<const unsigned char> bytes, const std::filesystem::path& path);
Result<SourceMesh> read_ply(std::span<const unsigned char> bytes, const std::filesystem::path& path);

/// mesh: that mesh in its own space; node: that node and all below it, flattened, in its own space; both -1: all nodes
/// of the default scene, flattened.
Result<SourceMesh> read_gltf(std::span<const unsigned char> bytes, const std::filesystem::path& path, int mesh,
                             int node);

}  // namespace farfield
