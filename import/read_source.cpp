// SPDX-License-Identifier: Apache-2.0
#include "import/read_source.h"

#include <fmt/format.h>

#include <cctype>
#include <cstring>

#include "base/hash.h"
#include "base/result.h"
#include "import/read_file.h"
#include "import/read_formats.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<unsigned char>;

/// The extension in lower case, without .gz.
std::string extension_of(fs::path path) {
  const auto lower = [](std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
  };
  if (lower(path.extension().string()) == ".gz") path.replace_extension();
  return lower(path.extension().string());
}

bool starts_with(const Bytes& bytes, std::string_view text) {
  return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

/// Content decides where it says what it is; OBJ does not, so there the name does.
Result<SourceMesh> read_as_named(const Bytes& bytes, const fs::path& path, const ImportOptions& options) {
  const std::string extension = extension_of(path);
  if (starts_with(bytes, "glTF") || extension == ".gltf" || extension == ".glb") {
    return read_gltf(bytes, path, options.mesh);
  }
  if (options.mesh >= 0) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: only glTF files have numbered meshes", path.string()));
  }
  if (starts_with(bytes, "ply") || extension == ".ply") return read_ply(bytes, path);
  if (extension == ".obj") return read_obj(bytes, path);
  if (extension == ".vdb" || extension == ".nvdb" || extension == ".vol") {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: a volume; only surfaces (OBJ, PLY, glTF) can be imported", path.string()));
  }
  return make_error(
      ErrorCode::Unsupported,
      fmt::format("{}: unknown kind of file; OBJ, PLY, glTF and glb are read, also gzipped", path.string()));
}

}  // namespace

Result<SourceMesh> read_source(const fs::path& path, const ImportOptions& options) {
  FARFIELD_TRY_LET(const auto bytes, read_file(path));
  FARFIELD_TRY_LET(auto mesh, read_as_named(bytes, path, options));
  const uint64_t contents = mix64(hash_values<unsigned char>(bytes), mesh.dependency_hash);
  mesh.source_hash = mix64(contents, static_cast<uint64_t>(options.mesh));
  return mesh;
}

}  // namespace farfield
