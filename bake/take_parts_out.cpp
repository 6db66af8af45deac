// SPDX-License-Identifier: Apache-2.0
#include "bake/take_parts_out.h"

#include <algorithm>
#include <map>

#include "base/index.h"
#include "base/index_map.h"
#include "cache/placed_parts.h"

namespace farfield {

namespace {

using Triangles = std::vector<uint32_t>;

/// A mesh and the triangles of its places that are there.
struct RepeatedMesh {
  std::vector<uint32_t> places;  ///< indices into SourceSurface::placements
  std::vector<Triangles> triangles;
};

mat4x3 surface_to_part(const SurfacePlacement& placement) { return mat4x3(inverse_of(placement.to_surface)); }

/// Whether a part takes at most a quarter of what its triangles would take in all places: rays pay for each place that
/// they pass. Level 0 of an oak takes 60 bytes a triangle, a place Embree's 104 bytes beside its own, a part a scene.
bool pays(size_t places, size_t triangles) {
  constexpr size_t kPerTriangle = 60, kPerPlace = sizeof(PartPlacement) + 104, kPerPart = 4096;
  return 4 * (kPerPlace * places + kPerTriangle * triangles + kPerPart) <= kPerTriangle * places * triangles;
}

/// The source face and material of each triangle, as the first place would have them.
bool are_alike(const SourceSurface& source, const Triangles& first, const Triangles& other) {
  if (first.size() != other.size()) return false;
  const uint32_t offset = source.source_face[other[0]] - source.source_face[first[0]];
  for (size_t i = 0; i < first.size(); ++i) {
    if (source.source_face[other[i]] - source.source_face[first[i]] != offset) return false;
    if (source.material[other[i]] != source.material[first[i]]) return false;
  }
  return true;
}

bool is_part(const SourceSurface& source, const RepeatedMesh& repeated) {
  const auto& triangles = repeated.triangles;
  if (triangles.size() < 2 || !pays(triangles.size(), triangles[0].size())) return false;
  const auto has_inverse = [&](uint32_t place) { return can_be_undone(surface_to_part(source.placements[place])); };
  return std::ranges::all_of(repeated.places, has_inverse) &&
         std::ranges::all_of(triangles, [&](const Triangles& other) { return are_alike(source, triangles[0], other); });
}

/// By the meshes' numbers.
std::map<uint32_t, RepeatedMesh> repeated_meshes(const SourceSurface& source) {
  std::vector<Triangles> triangles(source.placements.size());
  for (uint32_t t = 0; t < source.triangles.size(); ++t) {
    if (source.placement[t] != kNoIndex) triangles[source.placement[t]].push_back(t);
  }
  std::map<uint32_t, RepeatedMesh> meshes;
  for (uint32_t place = 0; place < triangles.size(); ++place) {
    if (triangles[place].empty()) continue;  // all of it has collapsed
    RepeatedMesh& repeated = meshes[source.placements[place].mesh];
    repeated.places.push_back(place);
    repeated.triangles.push_back(std::move(triangles[place]));
  }
  return meshes;
}

/// Puts triangles of the source together anew.
class PartedBuilder {
 public:
  explicit PartedBuilder(const SourceSurface& source) : source_(source) {
    out_.surface.materials = source.materials;
    out_.surface.origin = source.origin;
  }

  /// All of one call may share vertices.
  void add(const Triangles& triangles, uint32_t part, const glm::dmat4x3& transform, const glm::dmat3& of_normals) {
    IndexMap vertices;
    const auto first_vertex = static_cast<uint32_t>(out_.surface.positions.size());
    for (const uint32_t t : triangles) {
      uvec3 corners;
      for (int k = 0; k < 3; ++k) {
        const uint32_t v = source_.triangles[t][k];
        const auto [index, is_new] = vertices.insert(v);
        if (is_new) out_.surface.positions.emplace_back(transform * glm::dvec4(source_.positions[v], 1.0));
        corners[k] = first_vertex + index;
      }
      out_.surface.triangles.push_back(corners);
      out_.part.push_back(part);
      copy_attributes(t, of_normals);
    }
  }

  PartedSource& out() { return out_; }

 private:
  void copy_attributes(uint32_t t, const glm::dmat3& of_normals) {
    SourceSurface& to = out_.surface;
    to.material.push_back(source_.material[t]);
    to.source_face.push_back(source_.source_face[t]);
    if (!source_.quad.empty()) to.quad.push_back(source_.quad[t]);
    for (size_t corner = 3 * size_t{t}; corner < 3 * size_t{t} + 3; ++corner) {
      if (!source_.corner_uv.empty()) to.corner_uv.push_back(source_.corner_uv[corner]);
      if (!source_.corner_color.empty()) to.corner_color.push_back(source_.corner_color[corner]);
      if (source_.corner_normal.empty()) continue;
      to.corner_normal.emplace_back(glm::normalize(of_normals * glm::dvec3(source_.corner_normal[corner])));
    }
  }

  const SourceSurface& source_;
  PartedSource out_;
};

}  // namespace

std::optional<PartedSource> take_parts_out(const SourceSurface& source) {
  if (source.placements.empty() || source.material_function) return std::nullopt;
  auto meshes = repeated_meshes(source);
  std::erase_if(meshes, [&](const auto& repeated) { return !is_part(source, repeated.second); });
  if (meshes.empty()) return std::nullopt;

  std::vector<uint8_t> is_placed(source.triangles.size());
  for (const auto& [mesh, repeated] : meshes) {
    for (const Triangles& triangles : repeated.triangles) {
      for (const uint32_t t : triangles) is_placed[t] = 1;
    }
  }
  Triangles own;
  for (uint32_t t = 0; t < is_placed.size(); ++t) {
    if (!is_placed[t]) own.push_back(t);
  }
  PartedBuilder builder(source);
  builder.add(own, 0, glm::dmat4x3(1.0), glm::dmat3(1.0));
  uint32_t part = 0;
  for (const auto& [mesh, repeated] : meshes) {
    const SurfacePlacement& first = source.placements[repeated.places[0]];
    const uint32_t first_face = source.source_face[repeated.triangles[0][0]];
    builder.add(repeated.triangles[0], part + 1, surface_to_part(first), glm::transpose(glm::dmat3(first.to_surface)));
    for (size_t i = 0; i < repeated.places.size(); ++i) {
      builder.out().places.push_back({surface_to_part(source.placements[repeated.places[i]]), part,
                                      source.source_face[repeated.triangles[i][0]] - first_face});
    }
    ++part;
  }
  return std::move(builder.out());
}

}  // namespace farfield
