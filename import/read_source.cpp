// SPDX-License-Identifier: Apache-2.0
#include "import/read_source.h"

#include <fmt/format.h>

#include <cstring>

#include "base/hash.h"
#include "base/result.h"
#include "base/text.h"
#include "import/gltf_parts.h"
#include "import/read_file.h"
#include "import/read_formats.h"
#include "import/read_volume.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<unsigned char>;

/// The extension in lower case, without .gz.
std::string extension_of(fs::path path) {
  if (lower_case(path.extension().string()) == ".gz") path.replace_extension();
  return lower_case(path.extension().string());
}

bool starts_with(const Bytes& bytes, std::string_view text) {
  return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

bool is_gltf(const Bytes& bytes, const fs::path& path) {
  const std::string extension = extension_of(path);
  return starts_with(bytes, "glTF") || extension == ".gltf" || extension == ".glb";
}

/// Content decides where it says what it is; OBJ does not, so there the name does.
Result<SourceMesh> read_as_named(const Bytes& bytes, const fs::path& path, const ImportOptions& options) {
  const std::string extension = extension_of(path);
  if (is_gltf(bytes, path)) return read_gltf(bytes, path, options.mesh, options.node);
  if (options.mesh >= 0 || options.node >= 0) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: only glTF files have numbered meshes and nodes", path.string()));
  }
  if (starts_with(bytes, "ply") || extension == ".ply") return read_ply(bytes, path);
  if (extension == ".obj") return read_obj(bytes, path);
  if (extension == ".vdb" || is_volume_file(path)) {
    return make_error(ErrorCode::Unsupported, fmt::format("{}: a volume, where a surface is wanted", path.string()));
  }
  if (extension == ".nvdb" || extension == ".vol") {
    return make_error(
        ErrorCode::Unsupported,
        fmt::format("{}: of volumes OpenVDB and NanoVDB files (.vdb, .nvdb) are read, not gzipped; convert it",
                    path.string()));
  }
  return make_error(
      ErrorCode::Unsupported,
      fmt::format("{}: unknown kind of file; OBJ, PLY, glTF and glb are read, also gzipped", path.string()));
}

uint64_t with_options(uint64_t hash, const ImportOptions& options) {
  hash = mix64(hash, static_cast<uint64_t>(options.mesh));
  if (options.node >= 0) hash = mix64(hash, static_cast<uint64_t>(options.node));
  const uint64_t subdivision = hash_of(options.subdivision);
  return tile_hash(subdivision == 0 ? hash : mix64(hash, subdivision), options.tile);
}

/// Files that are not there do not count.
uint64_t combine(uint64_t main_file, const std::vector<HashedFile>& files) {
  uint64_t others = 0;
  for (const HashedFile& file : files) {
    if (file.hash != 0) others = mix64(others, file.hash);
  }
  return mix64(main_file, others);
}

}  // namespace

FileHashes::FileHashes() = default;
FileHashes::~FileHashes() = default;

Result<uint64_t> FileHashes::of(const fs::path& path) {
  const auto known = known_.find(path);
  if (known != known_.end()) return known->second;
  const auto bytes = read_file(path);
  const Result<uint64_t> hash =
      bytes ? Result<uint64_t>(hash_values<unsigned char>(*bytes)) : tl::unexpected(bytes.error());
  return known_.emplace(path, hash).first->second;
}

std::optional<uint64_t> FileHashes::of_part(const fs::path& path, int mesh, int node, const Bytes* bytes) {
  if (mesh < 0 && node < 0) return std::nullopt;
  const auto [known, is_new] = parts_.try_emplace(path);
  if (is_new) {
    Bytes own;
    if (!bytes) own = read_file(path).value_or(Bytes());
    const Bytes& all = bytes ? *bytes : own;
    auto parts = is_gltf(all, path) ? GltfParts::open(all, path) : std::nullopt;
    if (parts) known->second = std::make_unique<GltfParts>(std::move(*parts));
  }
  return known->second ? known->second->hash(mesh, node) : std::nullopt;
}

Result<SourceMesh> read_source(const fs::path& path, const ImportOptions& options) {
  FARFIELD_TRY_LET(const auto bytes, read_file(path));
  FileHashes own;
  FileHashes& hashes = options.known_hashes ? *options.known_hashes : own;
  const auto part = hashes.of_part(path, options.mesh, options.node, &bytes);
  FARFIELD_TRY_LET(auto mesh, read_as_named(bytes, path, options));
  const uint64_t hash = part ? *part : combine(hash_values<unsigned char>(bytes), mesh.source_files);
  mesh.source_hash = with_options(hash, options);
  return mesh;
}

Result<uint64_t> hash_source(const fs::path& path, const std::vector<HashedFile>& files, const ImportOptions& options) {
  if (is_volume_file(path)) return hash_volume(path, options.fog);
  FileHashes own;
  FileHashes& hashes = options.known_hashes ? *options.known_hashes : own;
  if (const auto part = hashes.of_part(path, options.mesh, options.node)) return with_options(*part, options);
  FARFIELD_TRY_LET(const auto main_file, hashes.of(path));
  std::vector<HashedFile> now = files;
  for (HashedFile& file : now) file.hash = hashes.of(path.parent_path() / file.path).value_or(0);
  return with_options(combine(main_file, now), options);
}

}  // namespace farfield
