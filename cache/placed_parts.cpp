// SPDX-License-Identifier: Apache-2.0
#include "cache/placed_parts.h"

#include <algorithm>

#include "base/index_map.h"
#include "cache/level_format.h"

namespace farfield {

namespace {

class Flattener {
 public:
  explicit Flattener(const LevelView& level) : level_(level) { flat_.header = level.header; }

  LevelData run() {
    add(0, level_.own_quad_count(), glm::dmat4x3(1.0), glm::dmat3(1.0), 0);
    for (const PartPlacement& placement : level_.placements) {
      const auto [first, end] = level_.part_quads(placement.part);
      add(first, end, to_level(placement), glm::transpose(linear_part(placement.level_to_part)),
          placement.source_face_offset);
    }
    return std::move(flat_);
  }

 private:
  void add(uint32_t first, uint32_t end, const glm::dmat4x3& transform, const glm::dmat3& of_normals,
           uint32_t source_face_offset) {
    first_vertex_ += static_cast<uint32_t>(vertices_.size());
    first_shading_vertex_ += static_cast<uint32_t>(shading_vertices_.size());
    vertices_.clear();
    shading_vertices_.clear();
    for (uint32_t q = first; q < end; ++q) {
      const Quad& quad = level_.quads[q];
      const auto vertex = [&](uint32_t v) { return placed_vertex(v, transform); };
      const uint32_t v0 = vertex(quad.v0), v1 = vertex(quad.v1), v2 = vertex(quad.v2), v3 = vertex(quad.v3);
      flat_.quads.push_back({v0, v1, v2, v3});
      flat_.quad_first_face.push_back(faces_);
      const uint32_t face = level_.quad_first_face[q];
      add_face(face, of_normals, source_face_offset);
      if (quad.is_pair()) add_face(face + 1, of_normals, source_face_offset);
    }
  }

  uint32_t placed_vertex(uint32_t v, const glm::dmat4x3& transform) {
    const auto [index, is_new] = vertices_.insert(v);
    if (is_new) flat_.positions.emplace_back(transform * glm::dvec4(level_.positions[v], 1.0));
    return first_vertex_ + index;
  }

  void add_face(uint32_t face, const glm::dmat3& of_normals, uint32_t source_face_offset) {
    ++faces_;
#define FARFIELD_COPY(id, Name, field, Element, Group) \
  if (SectionGroup::Group == SectionGroup::Faces && !level_.field.empty()) flat_.field.push_back(level_.field[face]);
    FARFIELD_LEVEL_ARRAYS(FARFIELD_COPY)
#undef FARFIELD_COPY
    if (!flat_.source_face.empty()) flat_.source_face.back() += source_face_offset << kSourceTurnBits;
    if (flat_.corner_vertex.empty()) return;
    uvec3& corners = flat_.corner_vertex.back();
    for (int k = 0; k < 3; ++k) corners[k] = shading_vertex(corners[k], of_normals);
  }

  uint32_t shading_vertex(uint32_t v, const glm::dmat3& of_normals) {
    const auto [index, is_new] = shading_vertices_.insert(v);
    if (is_new) add_shading_vertex(v, of_normals);
    return first_shading_vertex_ + index;
  }

  void add_shading_vertex(uint32_t v, const glm::dmat3& of_normals) {
    if (!level_.shading_normal.empty()) {
      const glm::dvec3 normal(unpack_normal(level_.shading_normal[v]));
      flat_.shading_normal.push_back(pack_normal(vec3(glm::normalize(of_normals * normal))));
    }
    if (!level_.shading_uv.empty()) flat_.shading_uv.push_back(level_.shading_uv[v]);
    if (!level_.shading_color.empty()) flat_.shading_color.push_back(level_.shading_color[v]);
  }

  const LevelView& level_;
  LevelData flat_;
  uint32_t faces_ = 0;
  uint32_t first_vertex_ = 0, first_shading_vertex_ = 0;  ///< of the place at hand
  IndexMap vertices_, shading_vertices_;                  ///< those of its part that it has so far
};

}  // namespace

bool can_be_undone(const mat4x3& transform) {
  return is_in_range(glm::dmat4x3(transform)) && glm::determinant(linear_part(transform)) != 0 &&
         is_in_range(to_level({transform, 0, 0}));
}

std::vector<uint32_t> part_vertices(const LevelView& level, uint32_t part) {
  std::vector<uint32_t> vertices;
  const auto [first, end] = level.part_quads(part);
  for (const Quad& quad : level.quads.subspan(first, end - first)) {
    vertices.insert(vertices.end(), {quad.v0, quad.v1, quad.v2, quad.v3});
  }
  std::ranges::sort(vertices);
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

LevelData flattened(const LevelView& level) { return Flattener(level).run(); }

}  // namespace farfield
