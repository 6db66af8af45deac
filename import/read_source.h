// SPDX-License-Identifier: Apache-2.0
// Reading one model: OBJ + MTL, PLY, glTF / glb, each also gzipped, to polygons with corner attributes and materials.
#pragma once

#include <filesystem>
#include <map>

#include "import/source_mesh.h"

namespace farfield {

/// The hashes of files that were read already, so that asking about each of many meshes reads their file once. Files
/// are taken not to change meanwhile. One thread at a time.
class FileHashes {
 public:
  /// Of the file's unpacked bytes. Errors: those of read_file().
  Result<uint64_t> of(const std::filesystem::path& path);

 private:
  std::map<std::filesystem::path, Result<uint64_t>> known_;
};

struct ImportOptions {
  int mesh =
      -1;  ///< glTF only: import this mesh alone, in its own space; -1: all nodes of the default scene, flattened
  int node = -1;  ///< glTF only: import all that this node of the file and those below show, in the node's own space
  FileHashes* known_hashes = nullptr;  ///< hash_source() looks there first; null: it reads
};

/// Reads the file and those that it refers to. Content decides what a file is where it says so, its name otherwise.
/// Positions may be infinite or NaN and polygons degenerate, as the file has them; all indices are in range. Errors:
/// NotFound, Io, BadFile, Unsupported, InvalidArgument (no such mesh or node): one line that names the file, the place
/// and the remedy. Never crashes on bad files.
Result<SourceMesh> read_source(const std::filesystem::path& path, const ImportOptions& options = {});

/// The source_hash that read_source() would give a source that still refers to `files`: of the bytes of the main file
/// and of those, and of the options. Hashes without looking at what the bytes mean. Errors: those of reading the main
/// file; the others may be missing.
Result<uint64_t> hash_source(const std::filesystem::path& path, const std::vector<HashedFile>& files,
                             const ImportOptions& options);

}  // namespace farfield
