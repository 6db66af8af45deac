// SPDX-License-Identifier: Apache-2.0
#include "tools/volume_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tools/console.h"

namespace farfield::tool {
namespace {

using Json = nlohmann::json;

/// Of the voxels that have a density.
double mean_density(const SourceVolume& volume) {
  double sum = 0;
  for (const uint32_t brick : volume.brick_table) {
    if (brick == kEmptyBrick) continue;
    for (const float density : volume.bricks[brick]) sum += static_cast<double>(density);
  }
  return sum / static_cast<double>(volume.active_voxels);
}

Json vector_json(const auto& v) { return {v.x, v.y, v.z}; }

}  // namespace

std::string volume_table(const std::string& name, const SourceVolume& volume) {
  const dvec3 size = dvec3(volume.dims) * volume.voxel_size;
  const double mean = mean_density(volume);
  std::string text = fmt::format("{}: a volume, not baked: {} voxels with a density in {} x {} x {}\n", name,
                                 volume.active_voxels, volume.dims.x, volume.dims.y, volume.dims.z);
  text += fmt::format("size {:.4g} x {:.4g} x {:.4g} scene units{}, from ({:.6g}, {:.6g}, {:.6g}), voxels of {:.4g}\n",
                      size.x, size.y, size.z, volume.rotation == glm::dmat3(1.0) ? "" : ", turned", volume.origin.x,
                      volume.origin.y, volume.origin.z, volume.voxel_size);
  text +=
      fmt::format("attenuation mean {:.4g}, largest {:.4g} per scene unit: {:.3g} and {:.3g} per voxel\n", mean,
                  volume.densest, mean * volume.voxel_size, static_cast<double>(volume.densest) * volume.voxel_size);
  if (volume.albedos.empty())
    text += fmt::format("albedo {:.4g}, {:.4g}, {:.4g}", volume.albedo.x, volume.albedo.y, volume.albedo.z);
  else
    text += "albedo varies";
  text += fmt::format("; anisotropy {:.4g}\n", volume.anisotropy);
  for (const std::string& warning : volume.warnings) text += fmt::format("warning: {}\n", one_line(warning));
  return text;
}

std::string volume_json(const std::string& name, const SourceVolume& volume) {
  Json json = {
      {"source", name},
      {"voxels", volume.active_voxels},
      {"dims", vector_json(volume.dims)},
      {"voxel_size", volume.voxel_size},
      {"origin", vector_json(volume.origin)},
      {"rotation", {vector_json(volume.rotation[0]), vector_json(volume.rotation[1]), vector_json(volume.rotation[2])}},
      {"mean_density", mean_density(volume)},
      {"largest_density", volume.densest},
      {"anisotropy", volume.anisotropy},
      {"warnings", volume.warnings}};
  if (volume.albedos.empty()) json["albedo"] = vector_json(volume.albedo);  // else it varies
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace farfield::tool
