// SPDX-License-Identifier: Apache-2.0
#include "evaluate/source_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_set>

#include "prefilter/face_materials.h"

namespace farfield {
namespace {

/// Sums over the triangles of one material, in double: there may be millions.
struct MaterialSums {
  uint64_t triangles = 0;
  double area = 0, stopping_area = 0;  ///< the second: times opacity
  dvec3 albedo{0.0}, transmission{0.0}, emission{0.0};

  void add(const FaceMaterial& face, double face_area) {
    const double weight = face_area * static_cast<double>(face.opacity);
    ++triangles;
    area += face_area;
    stopping_area += weight;
    albedo += weight * dvec3(face.specular + (1.0f - face.specular) * face.diffuse);
    transmission += weight * dvec3(face.transmission);
    emission += weight * dvec3(face.emission);
  }
};

void add_map(const char* use, const SourceTexture& map, std::vector<MapSummary>& out) {
  if (map) out.push_back({use, map.image->width(), map.image->height()});
  if (map.is_missing) out.push_back({use});
}

std::vector<MapSummary> maps_of(const SourceMaterial& material) {
  std::vector<MapSummary> maps;
  add_map("base colour", material.base_color_map, maps);
  add_map("opacity", material.alpha_map, maps);
  add_map("metallic roughness", material.metallic_roughness_map, maps);
  add_map("normal", material.normal_map, maps);
  add_map("emission", material.emission_map, maps);
  return maps;
}

MaterialSummary to_summary(const SourceMaterial& material, const MaterialSums& sums, double whole_area) {
  MaterialSummary out;
  out.name = material.name;
  out.triangles = sums.triangles;
  out.area_share = sums.area / whole_area;
  out.opacity = static_cast<float>(sums.stopping_area / sums.area);
  if (sums.stopping_area > 0) {
    out.albedo = vec3(sums.albedo / sums.stopping_area);
    out.transmission = vec3(sums.transmission / sums.stopping_area);
    out.emission = vec3(sums.emission / sums.stopping_area);
  }
  out.alpha_mode = material.alpha_mode;
  out.maps = maps_of(material);
  return out;
}

uint64_t count_distinct(const std::vector<uint32_t>& numbers) {
  return std::unordered_set<uint32_t>(numbers.begin(), numbers.end()).size();
}

}  // namespace

std::vector<std::string> MaterialSummary::suspicions() const {
  std::vector<std::string> out;
  const bool is_transparent = opacity < kTransparentOpacity;
  if (is_transparent) out.push_back("fully transparent");
  const float light = max_component(albedo + transmission);
  if (!is_transparent && light < kBlackAlbedo && max_component(emission) <= 0) out.push_back("black");
  for (const MapSummary& map : maps)
    if (map.is_missing()) out.push_back(fmt::format("{} map missing", map.use));
  return out;
}

SourceSummary summarise_source(const ImportedAsset& asset, const Job& job) {
  const SourceSurface& source = asset.source;
  const Surface faces = average_faces(source, job);
  std::vector<MaterialSums> sums(source.materials.size());
  SourceSummary out;
  for (size_t t = 0; t < source.triangles.size(); ++t) {
    const double area = 0.5 * glm::length(source.area_vector(t));
    sums[source.material[t]].add(faces.materials[t], area);
    out.area += area;
  }
  for (size_t m = 0; m < sums.size(); ++m) {
    if (sums[m].triangles == 0)
      ++out.unused_materials;
    else
      out.materials.push_back(to_summary(source.materials[m], sums[m], out.area));
  }
  std::stable_sort(out.materials.begin(), out.materials.end(),
                   [](const auto& a, const auto& b) { return a.area_share > b.area_share; });
  const Box3 bounds = source.bounds();
  out.polygons = count_distinct(source.source_face);
  out.triangles = source.triangles.size();
  out.vertices = source.positions.size();
  out.lower = source.origin + dvec3(bounds.lower);
  out.upper = source.origin + dvec3(bounds.upper);
  out.origin = source.origin;
  out.warnings = asset.warnings;
  return out;
}

Result<SourceSummary> summarise_source(const std::filesystem::path& path, const ImportOptions& options,
                                       const Job& job) {
  job.report(0.0, "import");
  FARFIELD_TRY_LET(const auto asset, import_asset(path, options));
  job.report(0.5, "materials");
  SourceSummary out = summarise_source(asset, job);
  if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "info: cancelled");
  return out;
}

}  // namespace farfield
