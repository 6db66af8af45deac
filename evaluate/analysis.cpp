// SPDX-License-Identifier: Apache-2.0
#include "evaluate/analysis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/result.h"
#include "base/temporary_file.h"
#include "evaluate/analysis_pictures.h"
#include "evaluate/surface_area.h"
#include "evaluate/views.h"
#include "import/read_volume.h"
#include "prefilter/triangle_pieces.h"

namespace farfield {
namespace {

constexpr int kViews = 12;

/// Points of the distribution of `values`, which weigh `weights`.
Spread spread_of(std::vector<std::pair<double, double>> value_and_weight) {
  std::ranges::sort(value_and_weight);
  double all = 0, below = 0;
  for (const auto& [value, weight] : value_and_weight) all += weight;
  Spread spread;
  for (const auto& [value, weight] : value_and_weight) {
    if (below < 0.5 * all) spread.median = value;
    if (below < 0.95 * all) spread.most = value;
    below += weight;
  }
  return spread;
}

FaceFigures figures_of_faces(const Surface& surface, double resolution) {
  FaceFigures figures;
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    const uvec3& t = surface.triangles[f];
    float longest = 0;
    for (int c = 0; c < 3; ++c)
      longest = std::max(longest, glm::distance(surface.positions[t[c]], surface.positions[t[(c + 1) % 3]]));
    figures.size.push_back(longest / static_cast<float>(resolution));
    const dvec3 across = area_vector_of(corners_of(surface, f));
    const double length = glm::length(across);
    figures.roughness.push_back(length > 0 ? normal_roughness(surface.materials[f], vec3(across / length)) : 0.0f);
  }
  return figures;
}

LevelAnalysis figures_of(const LevelSurfaces& level, const FaceFigures& faces) {
  LevelAnalysis result;
  result.level = level.level, result.grid = level.grid, result.resolution = level.resolution;
  result.faces_before = level.macrosurface.triangles.size();
  result.faces = level.simplified.triangles.size();
  result.sub_resolution = level.sub_resolution.triangles.size();
  const double macro = surface_area(level.macrosurface), sub = surface_area(level.sub_resolution);
  result.macrosurface_share = macro + sub > 0 ? macro / (macro + sub) : 0;

  std::vector<std::pair<double, double>> sizes;
  double roughness = 0, area = 0;
  for (size_t f = 0; f < faces.size.size(); ++f) {
    const double weight = face_area(level.simplified, f);
    sizes.emplace_back(faces.size[f], weight);
    roughness += weight * faces.roughness[f], area += weight;
  }
  result.face_size = spread_of(std::move(sizes));
  result.normal_roughness = area > 0 ? roughness / area : 0;
  return result;
}

Result<void> check_options(const AnalyseOptions& options) {
  if (is_volume_file(options.source))
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: is a volume; only models have surfaces to analyse", options.source.string()));
  if (options.view < 0 || options.view >= kViews)
    return make_error(ErrorCode::InvalidArgument, fmt::format("analyse: views are 0 to {}", kViews - 1));
  return {};
}

}  // namespace

float normal_roughness(const FaceMaterial& material, const vec3& normal) {
  const SymMat3& s = material.sggx;
  const float along = s.quadratic(normal), across = s.trace() - along;
  if (!(across > 0)) return 0;
  return along > 0.5f * across ? std::sqrt(0.5f * across / along) : 1.0f;
}

Result<Analysis> analyse(const AnalyseOptions& options) {
  FARFIELD_TRY(check_options(options));
  FARFIELD_TRY_LET(const auto folder, TemporaryFolder::create());  // of level 0, whose bytes are known once written
  const vec3 direction = view_directions(kViews)[static_cast<size_t>(options.view)];
  Analysis analysis;
  Box3 bounds;  // of the first level: the frame of all pictures
  BakeOptions bake_options = options.bake;
  bake_options.surfaces_only = true;
  bake_options.see_surfaces = [&](const LevelSurfaces& level) -> Result<void> {
    const FaceFigures faces = figures_of_faces(level.simplified, level.resolution);
    LevelAnalysis figures = figures_of(level, faces);
    if (options.cell_px > 0) {
      if (bounds.is_empty()) {
        bounds = level.macrosurface.bounds();
        bounds.extend(level.sub_resolution.bounds());
      }
      FARFIELD_TRY_LET(figures.pictures, draw_analysis(level, faces, bounds, direction, options.cell_px));
    }
    if (options.compare && !level.macrosurface.triangles.empty())
      figures.simplifiers = compare_simplifiers(level.macrosurface, level.simplified, level.resolution);
    analysis.levels.push_back(std::move(figures));
    return {};
  };
  FARFIELD_TRY_LET(auto report, bake(options.source, folder.path() / "surfaces", bake_options));
  for (const LevelReport& level : report.levels) {
    const bool is_made =
        std::ranges::any_of(analysis.levels, [&](const LevelAnalysis& made) { return made.level == level.level; });
    if (level.level > 0 && !is_made) analysis.grids_not_made.push_back(level.grid);
  }
  analysis.warnings = std::move(report.warnings);
  return analysis;
}

}  // namespace farfield
