// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/scene_names.h"

#include <fmt/format.h>

#include "cache/manifest.h"
#include "path_tracer/cryptomatte.h"

namespace farfield {

namespace {

std::string material_name(const std::string& name, size_t number) {
  return name.empty() ? fmt::format("material {}", number) : name;
}

std::vector<std::string> material_names(const Manifest& manifest) {
  std::vector<std::string> names;
  for (const AssetMaterial& material : manifest.materials) names.push_back(material_name(material.name, names.size()));
  if (names.empty()) names.push_back(material_name("", 0));
  return names;
}

}  // namespace

std::string object_name(const GltfInstance& instance) {
  return instance.name.empty() ? fmt::format("node {}", instance.node) : instance.name;
}

Result<MaterialNames> read_material_names(std::span<const std::filesystem::path> folders) {
  MaterialNames names(folders.size());
  for (size_t mesh = 0; mesh < folders.size(); ++mesh) {
    if (folders[mesh].empty()) continue;
    FARFIELD_TRY_LET(const auto manifest, read_manifest(folders[mesh]));
    names[mesh] = material_names(manifest);
  }
  return names;
}

std::set<std::string> names_of_objects(std::span<const GltfInstance> instances) {
  std::set<std::string> names;
  for (const GltfInstance& instance : instances) names.insert(object_name(instance));
  return names;
}

std::set<std::string> names_of_materials(std::span<const GltfInstance> instances, const MaterialNames& names) {
  std::set<std::string> shown = {kPrefilteredName};
  for (const GltfInstance& instance : instances) shown.insert(names[instance.mesh].begin(), names[instance.mesh].end());
  return shown;
}

SceneIds::SceneIds(const MaterialNames& names) : prefiltered_(cryptomatte_id(kPrefilteredName)) {
  for (const std::vector<std::string>& of_mesh : names) {
    std::vector<uint32_t>& ids = materials_.emplace_back();
    for (const std::string& name : of_mesh) ids.push_back(cryptomatte_id(name));
  }
}

void SceneIds::add_instance(const GltfInstance& instance) {
  objects_.push_back(cryptomatte_id(object_name(instance)));
  meshes_.push_back(instance.mesh);
}

uint32_t SceneIds::object(const Interaction& seen) const {
  return seen.instance < objects_.size() ? objects_[seen.instance] : 0;
}

uint32_t SceneIds::material(const Interaction& seen) const {
  if (seen.instance >= meshes_.size()) return 0;
  const std::vector<uint32_t>& ids = materials_[meshes_[seen.instance]];
  return seen.material < ids.size() ? ids[seen.material] : prefiltered_;
}

}  // namespace farfield
