// SPDX-License-Identifier: Apache-2.0
#include "prefilter/cut_tile.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/index.h"
#include "prefilter/edge_table.h"

namespace farfield {
namespace {

/// Where a face begins along each axis. Faces of a regular grid are cut between rows then, without teeth.
vec3 begin_of(const SourceSurface& surface, uint32_t face) {
  const uvec3& t = surface.triangles[face];
  return glm::min(surface.positions[t.x], glm::min(surface.positions[t.y], surface.positions[t.z]));
}

int widest_axis(const SourceSurface& surface, std::span<const uint32_t> faces) {
  Box3 box;
  for (const uint32_t face : faces) box.extend(begin_of(surface, face));
  const vec3 size = box.size();
  return size.x >= size.y && size.x >= size.z ? 0 : size.z >= size.y ? 2 : 1;
}

/// Puts about `wanted` of the faces first, those with the smaller coordinates, and says how many; at least one on
/// either side. 0 < wanted < faces.size().
size_t part_faces(const SourceSurface& surface, std::span<uint32_t> faces, size_t wanted) {
  const int axis = widest_axis(surface, faces);
  const auto key = [&](uint32_t face) { return begin_of(surface, face)[axis]; };
  const auto is_before = [&](uint32_t a, uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); };
  std::ranges::nth_element(faces, faces.begin() + static_cast<std::ptrdiff_t>(wanted), is_before);
  const float limit = key(faces[wanted]);
  const auto rest = std::partition(faces.begin(), faces.end(), [&](uint32_t face) { return key(face) < limit; });
  const auto before = static_cast<size_t>(rest - faces.begin());
  if (before > 0) return before;
  std::ranges::nth_element(faces, faces.begin() + static_cast<std::ptrdiff_t>(wanted), is_before);  // all in one row
  return wanted;
}

/// The faces of a tile, ascending.
std::vector<uint32_t> faces_of_tile(const SourceSurface& whole, MeshTile tile) {
  std::vector<uint32_t> all(whole.triangles.size());
  if (all.size() < tile.count) return {};
  std::iota(all.begin(), all.end(), 0u);
  std::span<uint32_t> faces = all;
  while (tile.count > 1) {
    const uint32_t first = tile.count / 2;
    const size_t cut = part_faces(whole, faces, faces.size() * first / tile.count);
    if (tile.number < first) {
      faces = faces.first(cut);
      tile.count = first;
    } else {
      faces = faces.subspan(cut);
      tile = {tile.number - first, tile.count - first};
    }
    if (faces.size() < tile.count) return {};
  }
  std::vector<uint32_t> result(faces.begin(), faces.end());
  std::ranges::sort(result);
  return result;
}

template <typename T>
void copy_corners(const std::vector<T>& from, uint32_t face, std::vector<T>& to) {
  if (!from.empty()) to.insert(to.end(), from.begin() + 3 * size_t{face}, from.begin() + 3 * size_t{face} + 3);
}

/// Textures are written into the asset: only those that its faces show.
void drop_unused_textures(SourceSurface& surface) {
  std::vector<uint8_t> is_used(surface.materials.size(), 0);
  for (const uint32_t material : surface.material) is_used[material] = 1;
  for (size_t m = 0; m < is_used.size(); ++m) {
    if (is_used[m]) continue;
    SourceMaterial& material = surface.materials[m];
    for (SourceTexture* map : material.maps()) *map = {};
    material.alpha_map = {};
  }
}

bool is_less(const vec3& a, const vec3& b) { return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z; }

/// Lets what is `on_cut` spread along borders over vertices that the source has not: they split edges of the cut.
void spread_to_new_vertices(const Surface& surface, const std::vector<uint8_t>& is_new, std::vector<uint8_t>& on_cut) {
  const EdgeTable edges = build_edge_table(surface.triangles, surface.positions.size());
  std::vector<std::pair<uint32_t, uint32_t>> border;
  for (uint32_t e = 0; e < edges.size(); ++e) {
    const uint32_t a = edges.smaller_vertex[e], b = edges.larger_vertex[e];
    if (edges.faces_of(e).size() == 1 && (is_new[a] || is_new[b])) border.emplace_back(a, b);
  }
  for (bool has_grown = true; has_grown;) {  // a chain doubles with each bisection: few rounds
    has_grown = false;
    for (const auto& [a, b] : border) {
      const uint32_t old = on_cut[a] ? a : b, other = on_cut[a] ? b : a;
      if (!on_cut[old] || on_cut[other] || !is_new[other]) continue;
      on_cut[other] = 1;
      has_grown = true;
    }
  }
}

}  // namespace

SourceSurface cut_tile(const SourceSurface& whole, const MeshTile& tile) {
  const std::vector<uint32_t> faces = faces_of_tile(whole, tile);
  SourceSurface part;
  part.origin = whole.origin;
  part.materials = whole.materials;
  part.material_function = whole.material_function;
  part.material_batch = whole.material_batch;

  std::vector<uint32_t> uses(whole.positions.size(), 0), number(whole.positions.size(), kNoIndex);
  for (const uvec3& t : whole.triangles)
    for (int c = 0; c < 3; ++c) ++uses[t[c]];
  for (const uint32_t face : faces) {
    uvec3 t = whole.triangles[face];
    for (int c = 0; c < 3; ++c) {
      --uses[t[c]];
      uint32_t& vertex = number[t[c]];
      if (vertex == kNoIndex) {
        vertex = static_cast<uint32_t>(part.positions.size());
        part.positions.push_back(whole.positions[t[c]]);
      }
      t[c] = vertex;
    }
    part.triangles.push_back(t);
    part.material.push_back(whole.material[face]);
    part.source_face.push_back(whole.source_face[face]);
    if (!whole.quad.empty()) part.quad.push_back(whole.quad[face]);
    copy_corners(whole.corner_uv, face, part.corner_uv);
    copy_corners(whole.corner_color, face, part.corner_color);
    copy_corners(whole.corner_normal, face, part.corner_normal);
  }
  part.on_cut.assign(part.positions.size(), 0);
  for (size_t v = 0; v < number.size(); ++v)
    if (number[v] != kNoIndex) part.on_cut[number[v]] = uses[v] > 0;
  drop_unused_textures(part);
  return part;
}

CutPoints::CutPoints(const SourceSurface& source, const ResolvedSurface& resolved) {
  if (source.on_cut.empty()) return;
  const Surface& surface = resolved.surface;
  std::vector<uint8_t> is_new(surface.positions.size(), 1), on_cut(surface.positions.size(), 0);
  for (size_t v = 0; v < source.on_cut.size(); ++v) {
    const uint32_t vertex = resolved.vertex_of[v];
    if (vertex == kNoIndex) continue;
    is_new[vertex] = 0;
    on_cut[vertex] = source.on_cut[v];
  }
  spread_to_new_vertices(surface, is_new, on_cut);
  for (size_t v = 0; v < on_cut.size(); ++v)
    if (on_cut[v]) points_.push_back(surface.positions[v]);
  std::ranges::sort(points_, is_less);
}

std::vector<uint8_t> CutPoints::find(std::span<const vec3> positions) const {
  if (points_.empty()) return {};
  std::vector<uint8_t> is_cut;
  is_cut.reserve(positions.size());
  for (const vec3& p : positions) is_cut.push_back(std::ranges::binary_search(points_, p, is_less));
  return is_cut;
}

}  // namespace farfield
