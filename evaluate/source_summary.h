// SPDX-License-Identifier: Apache-2.0
// `farfield info` of a model: what the import understood of it, before a bake spends time on it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "base/surface_material.h"
#include "base/vec.h"
#include "prefilter/condition.h"

namespace farfield {

/// A map that the source names for a material.
struct MapSummary {
  std::string use;            ///< "base colour", "opacity", "normal", ...
  int width = 0, height = 0;  ///< pixels; 0: it could not be read, a warning of the source says why
  bool is_missing() const { return width == 0; }
};

/// A material and its means over the triangles that have it.
struct MaterialSummary {
  std::string name;  ///< as the file has it; may be empty
  uint64_t triangles = 0;
  double area_share = 0;    ///< of the whole surface's area, in [0, 1]
  vec3 albedo{0.0f};        ///< diffuse + specular of what is there: weighted by area and opacity; linear
  vec3 transmission{0.0f};  ///< diffuse transmission, the same way
  vec3 emission{0.0f};      ///< linear radiance, the same way
  float opacity = 0;        ///< share of rays that it stops, weighted by area
  AlphaMode alpha_mode = AlphaMode::Opaque;
  std::vector<MapSummary> maps;

  /// What is probably not meant, in a few words each: "fully transparent", "black", "base colour map missing".
  std::vector<std::string> suspicions() const;
};
inline constexpr float kBlackAlbedo = 0.01f;         ///< darker than soot: below it no light is left after one bounce
inline constexpr float kTransparentOpacity = 0.01f;  ///< below it a surface cannot be seen

struct SourceSummary {
  uint64_t polygons = 0;                 ///< of the file, as far as they have area
  uint64_t triangles = 0, vertices = 0;  ///< conditioned: welded, without doubles
  dvec3 lower{0.0}, upper{0.0};          ///< bounds in the source's space, in its unit
  dvec3 origin{0.0};                     ///< of baked positions in that space
  double area = 0;
  std::vector<MaterialSummary> materials;  ///< that a face has; by area, largest first
  uint64_t unused_materials = 0;           ///< that no face with area has
  std::vector<std::string> warnings;       ///< of the import, one line each
};

/// Imports the file as a bake would. Any thread. Errors: those of import_asset(), Cancelled.
Result<SourceSummary> summarise_source(const std::filesystem::path& path, const ImportOptions& options = {},
                                       const Job& job = {});

/// The same of what is imported already.
SourceSummary summarise_source(const ImportedAsset& asset, const Job& job = {});

}  // namespace farfield
