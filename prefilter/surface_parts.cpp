// SPDX-License-Identifier: Apache-2.0
#include "prefilter/surface_parts.h"

#include <numeric>

#include "base/index.h"
#include "cache/level.h"
#include "prefilter/disjoint_sets.h"

namespace farfield {
namespace {

/// Sorts 0 .. part_of.size() - 1 by part; kNoIndex is left out.
void group_by_part(const std::vector<uint32_t>& part_of, size_t part_count, std::vector<uint32_t>& first,
                   std::vector<uint32_t>& items) {
  first.assign(part_count + 1, 0);
  for (const uint32_t part : part_of) {
    if (part != kNoIndex) ++first[part + 1];
  }
  for (size_t part = 0; part < part_count; ++part) first[part + 1] += first[part];
  items.resize(first.back());
  std::vector<uint32_t> next(first.begin(), first.end() - 1);
  for (uint32_t i = 0; i < part_of.size(); ++i) {
    if (part_of[i] != kNoIndex) items[next[part_of[i]]++] = i;
  }
}

}  // namespace

SurfaceParts find_parts(const Surface& surface) {
  DisjointSets vertices(surface.positions.size());
  for (const uvec3& t : surface.triangles) vertices.join(t.x, t.y), vertices.join(t.x, t.z);

  std::vector<uint32_t> part_of_vertex(surface.positions.size(), kNoIndex), part_of_face(surface.triangles.size());
  uint32_t part_count = 0;
  for (size_t face = 0; face < surface.triangles.size(); ++face) {
    uint32_t& part = part_of_vertex[vertices.least_of(surface.triangles[face].x)];
    if (part == kNoIndex) part = part_count++;
    part_of_face[face] = part;
  }
  for (const uvec3& t : surface.triangles) {
    for (int c = 0; c < 3; ++c) part_of_vertex[t[c]] = part_of_vertex[vertices.least_of(t[c])];
  }
  // A root that no face uses can not exist: it is a vertex of a face or alone.
  SurfaceParts parts;
  group_by_part(part_of_face, part_count, parts.first_face, parts.faces);
  group_by_part(part_of_vertex, part_count, parts.first_vertex, parts.vertices);
  parts.local_vertex.assign(surface.positions.size(), kNoIndex);
  for (size_t part = 0; part < part_count; ++part) {
    uint32_t next = 0;
    for (const uint32_t vertex : parts.vertices_of(part)) parts.local_vertex[vertex] = next++;
  }
  return parts;
}

WorkingSurface begin_work(const Surface& surface) {
  WorkingSurface working{surface, std::vector<uint32_t>(surface.positions.size()),
                         std::vector<uint8_t>(surface.triangles.size(), 1)};
  std::iota(working.merged_into.begin(), working.merged_into.end(), 0u);
  return working;
}

SimplifyResult finish_work(const WorkingSurface& working, const SurfaceParts& parts) {
  const Surface& from = working.surface;
  SimplifyResult result;
  result.surface.origin = from.origin;
  result.vertex_map.assign(from.positions.size(), kMorphVoxelized);
  for (uint32_t v = 0; v < from.positions.size(); ++v) {
    if (parts.local_vertex[v] == kNoIndex || working.merged_into[v] != v) continue;
    result.vertex_map[v] = static_cast<uint32_t>(result.surface.positions.size());
    result.surface.positions.push_back(from.positions[v]);
  }
  // Ascending: what a vertex merged into is smaller, so where that went is known.
  for (uint32_t v = 0; v < from.positions.size(); ++v) result.vertex_map[v] = result.vertex_map[working.merged_into[v]];

  result.face_map.assign(from.triangles.size(), kMorphCollapsed);
  for (size_t f = 0; f < from.triangles.size(); ++f) {
    if (!working.is_face_alive[f]) continue;
    const uvec3& t = from.triangles[f];
    result.face_map[f] = static_cast<uint32_t>(result.surface.triangles.size());
    result.surface.triangles.emplace_back(result.vertex_map[t.x], result.vertex_map[t.y], result.vertex_map[t.z]);
    result.surface.materials.push_back(from.materials[f]);
    if (from.has_quads()) result.surface.quad.push_back(from.quad[f]);
  }
  return result;
}

}  // namespace farfield
