// SPDX-License-Identifier: Apache-2.0
#include "prefilter/quad_part.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/index.h"

namespace farfield {
namespace {

/// A quad of two triangles that share an edge and wind alike; its first half is `a`, turned.
std::optional<PolygonCorners> join_halves(const uvec3& a, const uvec3& b) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const uint32_t from = a[i], to = a[(i + 1) % 3], apex = b[(j + 2) % 3];
      if (b[j] != to || b[(j + 1) % 3] != from || apex == a[(i + 2) % 3]) continue;
      return PolygonCorners(to, a[(i + 2) % 3], from, apex);
    }
  }
  return std::nullopt;
}

}  // namespace

std::vector<uint32_t> find_other_halves(std::span<const uint32_t> quad) {
  std::vector<std::pair<uint32_t, uint32_t>> halves;  // quad, triangle
  for (uint32_t f = 0; f < quad.size(); ++f) {
    if (quad[f] != kNoIndex) halves.emplace_back(quad[f], f);
  }
  std::sort(halves.begin(), halves.end());
  std::vector<uint32_t> other(quad.size(), kNoIndex);
  for (size_t i = 0; i + 1 < halves.size(); ++i) {
    if (halves[i].first != halves[i + 1].first) continue;
    other[halves[i].second] = halves[i + 1].second;
    other[halves[i + 1].second] = halves[i].second;
  }
  return other;
}

QuadPart extract_quad_part(const Surface& surface, const SurfaceParts& parts, size_t part) {
  QuadPart result;
  for (const uint32_t vertex : parts.vertices_of(part)) result.positions.emplace_back(surface.positions[vertex]);
  const auto faces = parts.faces_of(part);
  std::vector<uint32_t> quad;
  std::vector<uvec3> triangles;
  for (uint32_t f = 0; f < faces.size(); ++f) {
    const uvec3& t = surface.triangles[faces[f]];
    triangles.emplace_back(parts.local_vertex[t.x], parts.local_vertex[t.y], parts.local_vertex[t.z]);
    result.materials.push_back(surface.materials[faces[f]]);
    quad.push_back(surface.quad[faces[f]]);
  }
  const std::vector<uint32_t> other_half = find_other_halves(quad);
  std::vector<uint8_t> is_taken(faces.size(), 0);
  for (uint32_t f = 0; f < faces.size(); ++f) {
    if (is_taken[f]) continue;
    const uint32_t other = other_half[f];
    const auto corners = other == kNoIndex ? std::nullopt : join_halves(triangles[f], triangles[other]);
    if (corners) is_taken[other] = 1;
    result.polygons.push_back(corners ? *corners : PolygonCorners(triangles[f], kNoIndex));
    result.triangles.push_back({f, corners ? other : kNoIndex});
  }
  return result;
}

}  // namespace farfield
