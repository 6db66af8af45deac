// SPDX-License-Identifier: Apache-2.0
#include "evaluate/simplifier_comparison.h"

#ifdef FARFIELD_HAS_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <utility>

#include "evaluate/surface_area.h"
#include "evaluate/surface_distance.h"
#include "prefilter/collapse_edges.h"
#include "prefilter/triangle_pieces.h"

namespace farfield {
namespace {

constexpr int kSamples = 20000;

/// Enclosed by faces that are all wound alike; nothing where there are others or a border.
std::optional<double> volume_of(const Surface& surface) {
  std::vector<std::pair<uint32_t, uint32_t>> edges, reversed;
  double volume = 0;
  const dvec3 middle(surface.bounds().center());
  for (const uvec3& t : surface.triangles) {
    for (int c = 0; c < 3; ++c) {
      edges.emplace_back(t[c], t[(c + 1) % 3]);
      reversed.emplace_back(t[(c + 1) % 3], t[c]);
    }
    const dvec3 a = dvec3(surface.positions[t.x]) - middle, b = dvec3(surface.positions[t.y]) - middle,
                c = dvec3(surface.positions[t.z]) - middle;
    volume += glm::dot(a, glm::cross(b, c)) / 6;
  }
  std::ranges::sort(edges);
  std::ranges::sort(reversed);
  if (edges != reversed || volume == 0) return std::nullopt;
  return std::abs(volume);
}

SimplifierFigures figures_of(std::string name, const Surface& before, const Surface& after, double resolution) {
  SimplifierFigures figures;
  figures.name = std::move(name);
  figures.faces = after.triangles.size();
  const SurfaceDistance distance = two_sided_distance(before, after, kSamples);
  figures.farthest = distance.farthest / resolution, figures.rms = distance.rms / resolution;
  figures.area_change = surface_area(after) / surface_area(before) - 1;
  const auto volume_before = volume_of(before), volume_after = volume_of(after);
  if (volume_before && volume_after) figures.volume_change = *volume_after / *volume_before - 1;
  return figures;
}

Surface with_placement(const Surface& before, VertexPlacement placement, double resolution) {
  EdgeCollapseOptions options;
  options.resolution = resolution;
  options.placement = placement;
  return collapse_edges(before, options).surface;
}

}  // namespace

#ifdef FARFIELD_HAS_MESHOPTIMIZER
bool has_quadrics() { return true; }

Surface simplified_by_quadrics(const Surface& before, size_t faces) {
  std::vector<uint32_t> kept(3 * before.triangles.size());
  kept.resize(meshopt_simplify(kept.data(), &before.triangles[0].x, kept.size(), &before.positions[0].x,
                               before.positions.size(), sizeof(vec3), 3 * faces, FLT_MAX, 0, nullptr));
  Surface after;
  after.positions = before.positions;
  for (size_t i = 0; i < kept.size(); i += 3) {
    const uvec3 face(kept[i], kept[i + 1], kept[i + 2]);
    if (glm::length(area_vector_of(corners_of(after, face))) > 0) after.triangles.push_back(face);
  }
  return after;
}
#else
bool has_quadrics() { return false; }

Surface simplified_by_quadrics(const Surface&, size_t) { return {}; }
#endif

std::vector<SimplifierFigures> compare_simplifiers(const Surface& before, const Surface& simplified,
                                                   double resolution) {
  std::vector<SimplifierFigures> all = {figures_of("ours", before, simplified, resolution)};
  for (const auto& [name, placement] : {std::pair("equal volume", VertexPlacement::EqualVolume),
                                        std::pair("closest points", VertexPlacement::ClosestPoints)})
    all.push_back(figures_of(name, before, with_placement(before, placement, resolution), resolution));
  const Surface quadrics = simplified_by_quadrics(before, simplified.triangles.size());
  if (!quadrics.triangles.empty()) all.push_back(figures_of("quadrics", before, quadrics, resolution));
  return all;
}

}  // namespace farfield
