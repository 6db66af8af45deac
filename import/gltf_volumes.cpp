// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_volumes.h"

#include <fmt/format.h>

#include "import/gltf_document.h"
#include "import/gltf_extras.h"

namespace farfield {
namespace {

constexpr const char* kKey = "farfield_volume";

Result<void> read_property(const tinygltf::Value& extras, const std::string& key, NamedVolume& volume) {
  const tinygltf::Value& value = extras.Get(key);
  if (key == "file" && value.IsString()) return volume.file = value.Get<std::string>(), Result<void>();
  if (key == "density_grid" && value.IsString())
    return volume.fog.density_grid = value.Get<std::string>(), Result<void>();
  if (key == "level_set" && value.IsBool()) return volume.fog.level_set = value.Get<bool>(), Result<void>();
  const auto number = extension_number(extras, key.c_str());
  if (key == "density_scale" && number) return volume.fog.density_scale = *number, Result<void>();
  if (key == "anisotropy" && number) return volume.fog.anisotropy = *number, Result<void>();
  if (key == "fibre_roughness" && number) return volume.fog.fibre_roughness = *number, Result<void>();
  const auto color = extension_vec3(extras, key.c_str());
  if (key == "albedo" && color) return volume.fog.albedo = *color, Result<void>();
  return bad_extras(kKey,
                    fmt::format("\"{}\" is unknown or of the wrong type; file, density_grid, density_scale, albedo, "
                                "anisotropy, fibre_roughness and level_set are read",
                                key));
}

}  // namespace

Result<std::optional<NamedVolume>> volume_of_extras(const tinygltf::Node& node) {
  return file_of_extras<NamedVolume>(node, kKey, read_property);
}

}  // namespace farfield
