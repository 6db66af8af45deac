// SPDX-License-Identifier: Apache-2.0
#include "cache/placed_parts.h"

#include <algorithm>
#include <cmath>

#include "base/index.h"
#include "cache/level_format.h"

namespace farfield {

namespace {

glm::dmat3 linear_part(const mat4x3& m) { return {glm::dvec3(m[0]), glm::dvec3(m[1]), glm::dvec3(m[2])}; }

bool is_in_range(const glm::dvec3& v) {
  return glm::all(glm::lessThanEqual(glm::abs(v), glm::dvec3(double{kEmbreeLargest})));  // false for NaN
}

bool is_in_range(const glm::dmat4x3& m) {
  return is_in_range(m[0]) && is_in_range(m[1]) && is_in_range(m[2]) && is_in_range(m[3]);
}

/// Numbers of copies: in each round everything is copied at most once.
class Numbers {
 public:
  explicit Numbers(size_t count) : number_(count, kNoIndex) {}

  void start_anew() {
    for (const uint32_t i : used_) number_[i] = kNoIndex;
    used_.clear();
  }
  /// The number of i; add() gives the first one of a round.
  template <typename Add>
  uint32_t of(uint32_t i, const Add& add) {
    if (number_[i] == kNoIndex) {
      number_[i] = add();
      used_.push_back(i);
    }
    return number_[i];
  }

 private:
  std::vector<uint32_t> number_, used_;
};

class Flattener {
 public:
  explicit Flattener(const LevelView& level)
      : level_(level),
        vertices_(level.positions.size()),
        shading_vertices_(
            std::max({level.shading_normal.size(), level.shading_uv.size(), level.shading_color.size()})) {
    flat_.header = level.header;
  }

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
    vertices_.start_anew();
    shading_vertices_.start_anew();
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
    return vertices_.of(v, [&] {
      flat_.positions.emplace_back(transform * glm::dvec4(level_.positions[v], 1.0));
      return static_cast<uint32_t>(flat_.positions.size() - 1);
    });
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
    return shading_vertices_.of(v, [&] {
      if (!level_.shading_normal.empty()) {
        const glm::dvec3 normal(unpack_normal(level_.shading_normal[v]));
        flat_.shading_normal.push_back(pack_normal(vec3(glm::normalize(of_normals * normal))));
      }
      if (!level_.shading_uv.empty()) flat_.shading_uv.push_back(level_.shading_uv[v]);
      if (!level_.shading_color.empty()) flat_.shading_color.push_back(level_.shading_color[v]);
      return shading_count_++;
    });
  }

  const LevelView& level_;
  LevelData flat_;
  uint32_t faces_ = 0, shading_count_ = 0;
  Numbers vertices_, shading_vertices_;
};

}  // namespace

glm::dmat4x3 inverse_of(const glm::dmat4x3& transform) {
  const glm::dmat3 linear = glm::inverse(glm::dmat3(transform[0], transform[1], transform[2]));
  return {linear[0], linear[1], linear[2], -(linear * transform[3])};
}

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
  vertices.erase(std::ranges::unique(vertices).begin(), vertices.end());
  return vertices;
}

LevelData flattened(const LevelView& level) { return Flattener(level).run(); }

}  // namespace farfield
