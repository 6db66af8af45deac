// SPDX-License-Identifier: Apache-2.0
#include "prefilter/wall_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prefilter/grid_cells.h"
#include "prefilter/material_filter.h"
#include "prefilter/random_lobe.h"
#include "prefilter/vertex_placement.h"
#include "scattering/albedo.h"

namespace farfield {
namespace {

constexpr int kReach = 3;                      ///< cells: mark_voxels() also marks what it passes by
constexpr double kMiddleToCorner = 2.0 / 3.0;  ///< of a piece whose edges are at most 1 long
constexpr float kEscapeLength = 1;             ///< in resolutions: how far light must get away

/// From the corner at 0.
double distance_to_cell(const ivec3& offset) {
  return glm::length(glm::max(glm::max(dvec3(offset), -dvec3(offset + 1)), dvec3(0)));
}

}  // namespace

Surface in_pieces(const Surface& wall, double longest) {
  Surface result;
  for (size_t face = 0; face < wall.triangles.size(); ++face) {
    for_each_piece(corners_of(wall, face), longest, [&](const TrianglePiece& piece) {
      const auto first = static_cast<uint32_t>(result.positions.size());
      for (const dvec3& p : piece) result.positions.emplace_back(p);
      result.triangles.emplace_back(first, first + 1, first + 2);
      result.materials.push_back(wall.materials[face]);
    });
  }
  return result;
}

NearestPoint::NearestPoint(const Surface& wall, const dvec3& origin, double cell_size) {
  for (size_t face = 0; face < wall.triangles.size(); ++face) {
    for_each_piece(in_cells(corners_of(wall, face), origin, cell_size), 1, [&](const TrianglePiece& piece) {
      pieces_[cell_key(ivec3(glm::floor(middle_of(piece))))].push_back(piece);
    });
  }
  for_each_cell_around(ivec3(0), kReach, [&](const ivec3& offset) {
    around_.push_back({offset, distance_to_cell(offset)});
  });
  std::ranges::stable_sort(around_, {}, &Neighbour::distance);
}

dvec3 NearestPoint::to(const dvec3& point) const {
  const dvec3 corner = glm::floor(point);
  const double beyond_reach = kMiddleToCorner + glm::length(point - corner);
  dvec3 nearest = point;
  double distance = std::numeric_limits<double>::infinity();
  for (const Neighbour& neighbour : around_) {
    if (neighbour.distance - beyond_reach > distance) break;
    const auto found = pieces_.find(cell_key(ivec3(corner) + neighbour.offset));
    if (found == pieces_.end()) continue;
    for (const TrianglePiece& t : found->second) {
      if (glm::length(middle_of(t) - point) - kMiddleToCorner > distance) continue;
      const dvec3 weight = closest_barycentric(point, t[0], t[1], t[2]);
      const dvec3 on_piece = weight.x * t[0] + weight.y * t[1] + weight.z * t[2];
      if (glm::length(on_piece - point) < distance) distance = glm::length(on_piece - point), nearest = on_piece;
    }
  }
  return nearest;
}

std::optional<PieceSeen> PieceViewer::look(const vec3& origin, const vec3& direction, float far,
                                           SplitMix& random) const {
  const auto hit = pieces_.first_stop(origin, direction, far, random);
  if (!hit) return {};
  PieceSeen seen{&pieces_.surface().materials[hit->triangle]};
  const float length = glm::length(hit->normal);
  if (!(length > 0)) return seen;
  seen.normal = hit->normal / (glm::dot(hit->normal, direction) < 0 ? length : -length);
  const vec3 on = random_lobe(seen.normal, random);
  const vec3 point = origin + hit->distance * direction;
  seen.escapes = !pieces_.is_stopped(point, on, 1e-4f * resolution_, kEscapeLength * resolution_, random);
  return seen;
}

const FaceMaterial& no_material() {
  static const FaceMaterial none = [] {
    FaceMaterial m;
    m.roughness2 = m.opacity = 0;
    return m;
  }();
  return none;
}

vec3 kept_light(const FaceMaterial& m, float caught, float usual_escape) {
  const vec3 albedo = glm::min(layered_albedo(m.specular, m.diffuse + m.transmission), vec3(1.0f));
  const vec3 absorbed = vec3(1.0f) - albedo;
  return vec3(1.0f) - caught * absorbed / glm::max(absorbed + albedo * usual_escape, vec3(1e-6f));
}

}  // namespace farfield
