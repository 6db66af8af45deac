// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_mesh_extras.h"

#include <fmt/format.h>

#include "base/text.h"
#include "import/gltf_extras.h"

namespace farfield {
namespace {

constexpr const char* kScheme = "farfield_subdivision";
constexpr const char* kMesh = "farfield_mesh";

Result<SubdivisionScheme> to_scheme(const tinygltf::Value& value, const char* key) {
  const auto scheme = parse_subdivision_scheme(value.IsString() ? value.Get<std::string>() : "");
  if (!scheme) return bad_extras(key, scheme.error().message);
  return *scheme;
}

Result<void> read_property(const tinygltf::Value& extras, const std::string& key, NamedMesh& mesh) {
  const tinygltf::Value& value = extras.Get(key);
  if (key == "file" && value.IsString()) return mesh.file = value.Get<std::string>(), Result<void>();
  if (key == "subdivision") {
    FARFIELD_TRY_LET(mesh.scheme, to_scheme(value, kMesh));
    return {};
  }
  return bad_extras(kMesh, fmt::format("\"{}\" is unknown or of the wrong type; file and subdivision are read", key));
}

/// Also with ".gz" behind it.
bool is_model(const std::string& file) {
  std::string name = lower_case(file);
  if (name.ends_with(".gz")) name.resize(name.size() - 3);
  return name.ends_with(".obj") || name.ends_with(".ply");
}

}  // namespace

Result<std::optional<SubdivisionScheme>> scheme_of_extras(const tinygltf::Mesh& mesh) {
  if (!mesh.extras.IsObject() || !mesh.extras.Has(kScheme)) return std::nullopt;
  return to_scheme(mesh.extras.Get(kScheme), kScheme);
}

Result<std::optional<NamedMesh>> mesh_of_extras(const tinygltf::Node& node) {
  FARFIELD_TRY_LET(auto mesh, file_of_extras<NamedMesh>(node, kMesh, read_property));
  if (mesh && !is_model(mesh->file)) return bad_extras(kMesh, fmt::format("{} is neither OBJ nor PLY", mesh->file));
  return mesh;
}

}  // namespace farfield
