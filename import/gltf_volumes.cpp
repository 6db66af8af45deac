// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_volumes.h"

#include <fmt/format.h>

#include <filesystem>

#include "import/gltf_document.h"

namespace farfield {
namespace {

constexpr const char* kKey = "farfield_volume";

tl::unexpected<Error> bad(const std::string& what) {
  return make_error(ErrorCode::BadFile, fmt::format("extras {}: {}", kKey, what));
}

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
  return bad(
      fmt::format("\"{}\" is unknown or of the wrong type; file, density_grid, density_scale, albedo, "
                  "anisotropy, fibre_roughness and level_set are read",
                  key));
}

}  // namespace

Result<std::optional<NamedVolume>> volume_of_extras(const tinygltf::Node& node) {
  if (!node.extras.IsObject() || !node.extras.Has(kKey)) return std::nullopt;
  const tinygltf::Value& extras = node.extras.Get(kKey);
  NamedVolume volume;
  if (extras.IsString()) {
    volume.file = extras.Get<std::string>();
  } else if (extras.IsObject()) {
    for (const std::string& key : extras.Keys()) FARFIELD_TRY(read_property(extras, key, volume));
  }
  if (volume.file.empty()) return bad("names no file");
  if (std::filesystem::path(volume.file).is_absolute()) return bad("its file must be relative to the scene's folder");
  return volume;
}

}  // namespace farfield
