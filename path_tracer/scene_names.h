// SPDX-License-Identifier: Apache-2.0
// What things are called in a picture's ids, and the ids of what a ray can meet.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "farfield/interaction.h"
#include "import/gltf_scene.h"

namespace farfield {

/// Levels behind level 0 mix materials, and have none of their own.
inline constexpr const char* kPrefilteredName = "(prefiltered)";

/// What an object is called: as its node, else by the node's number.
std::string object_name(const GltfInstance& instance);

/// Per mesh the names of its asset's materials: as the source has them, else by number. At least one where there is a
/// folder, since an asset without materials shows material 0; none where there is not. Errors: those of read_manifest.
using MaterialNames = std::vector<std::vector<std::string>>;
Result<MaterialNames> read_material_names(std::span<const std::filesystem::path> folders);

/// All that pixels of these instances may show; what prefiltered levels are called too.
std::set<std::string> names_of_objects(std::span<const GltfInstance> instances);
std::set<std::string> names_of_materials(std::span<const GltfInstance> instances, const MaterialNames& names);

/// cryptomatte_id of the names above, for rays. Immutable once instances are added.
class SceneIds {
 public:
  SceneIds() = default;  ///< knows nothing: all ids are 0
  explicit SceneIds(const MaterialNames& names);
  /// In the order of the runtime's instances.
  void add_instance(const GltfInstance& instance);

  /// 0 for instances that were not added.
  uint32_t object(const Interaction& seen) const;
  uint32_t material(const Interaction& seen) const;

 private:
  std::vector<std::vector<uint32_t>> materials_;  ///< per mesh
  std::vector<uint32_t> objects_;                 ///< per InstanceId
  std::vector<size_t> meshes_;                    ///< per InstanceId
  uint32_t prefiltered_ = 0;
};

}  // namespace farfield
