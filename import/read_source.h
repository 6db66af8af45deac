// SPDX-License-Identifier: Apache-2.0
// Reading one model: OBJ + MTL, PLY, glTF / glb, each also gzipped, to polygons with corner attributes and materials.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "import/fog_options.h"
#include "import/mesh_tile.h"
#include "import/source_mesh.h"
#include "import/subdivision_options.h"

namespace farfield {

class GltfParts;
class KnownMesh;

/// The hashes of what was read already, so that asking about each of many meshes reads their file once. Files
/// are taken not to change meanwhile. One thread at a time.
class FileHashes {
 public:
  FileHashes();
  ~FileHashes();
  FileHashes(const FileHashes&) = delete;
  FileHashes& operator=(const FileHashes&) = delete;

  /// Of the file's unpacked bytes. Errors: those of read_file().
  Result<uint64_t> of(const std::filesystem::path& path);
  /// Of what a mesh, or a node and those below it, takes from a glTF file and those that it refers to. Nothing where
  /// that cannot be told from the rest of the file.
  /// bytes: the file's unpacked ones, if they are at hand.
  std::optional<uint64_t> of_part(const std::filesystem::path& path, int mesh, int node,
                                  const std::vector<unsigned char>* bytes = nullptr);

 private:
  std::map<std::filesystem::path, Result<uint64_t>> known_;
  std::map<std::filesystem::path, std::unique_ptr<GltfParts>> parts_;  ///< null: of no use
};

struct ImportOptions {
  int mesh =
      -1;  ///< glTF only: import this mesh alone, in its own space; -1: all nodes of the default scene, flattened
  int node = -1;    ///< glTF only: import all that this node of the file and those below show, in the node's own space
  MeshTile tile{};  ///< import_asset() gives only this part of the mesh
  SubdivisionOptions subdivision{};    ///< of meshes; read_source() gives the cage, import_asset() what becomes of it
  FogOptions fog{};                    ///< OpenVDB files only: what read_volume() is given
  FileHashes* known_hashes = nullptr;  ///< hashes are looked for there first; null: they read
  KnownMesh* known_mesh = nullptr;     ///< import_asset() keeps there what tiles are cut from; null: each tile reads it
};

/// Reads the file and those that it refers to. Content decides what a file is where it says so, its name otherwise.
/// Positions may be infinite or NaN and polygons degenerate, as the file has them; all indices are in range. Errors:
/// NotFound, Io, BadFile, Unsupported, InvalidArgument (no such mesh or node): one line that names the file, the place
/// and the remedy. Never crashes on bad files.
Result<SourceMesh> read_source(const std::filesystem::path& path, const ImportOptions& options = {});

/// The source_hash that read_source(), or of an OpenVDB file read_volume(), would give a source that still refers to
/// `files`: of the bytes of the main file and of those, or of what a mesh or node takes from a glTF file, and of the
/// options. Does not look at what the bytes mean. Errors: those of reading the main file; the others may be missing.
Result<uint64_t> hash_source(const std::filesystem::path& path, const std::vector<HashedFile>& files,
                             const ImportOptions& options);

}  // namespace farfield
