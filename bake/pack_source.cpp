// SPDX-License-Identifier: Apache-2.0
#include "bake/pack_source.h"

#include <algorithm>
#include <unordered_map>

#include "base/check.h"
#include "base/hash.h"
#include "prefilter/face_textures.h"

namespace farfield {
namespace {

bool needs_uv(const SourceSurface& source) {
  if (source.corner_uv.empty()) return false;
  return source.material_function || std::ranges::any_of(source.materials, has_textures);
}

bool needs_colors(const SourceSurface& source) {
  const std::vector<vec4>& colors = source.corner_color;
  for (size_t c = 0; c < colors.size(); c += 3) {
    const bool is_even = colors[c] == colors[c + 1] && colors[c] == colors[c + 2];
    const bool is_white = colors[c] == vec4(1.0f);
    const bool has_partner = source.material_function || has_textures(source.material_of(c / 3));
    if (!is_even || (has_partner && !is_white)) return true;
  }
  return false;
}

/// All that makes corners different.
struct ShadingVertex {
  PackedNormal normal{};
  vec2 uv{0.0f};
  PackedVertexColor color{};
};
static_assert(sizeof(ShadingVertex) == 16, "hashed byte by byte: no padding");

class CornerPacker {
 public:
  CornerPacker(const SourceSurface& source, LevelData& level)
      : source_(source),
        level_(level),
        has_normals_(!source.corner_normal.empty()),
        has_uv_(needs_uv(source)),
        has_colors_(needs_colors(source)) {}

  bool has_any() const { return has_normals_ || has_uv_ || has_colors_; }
  bool has_texture_coordinates_or_colors() const { return has_uv_ || has_colors_; }

  uint32_t vertex_of(size_t corner) {
    ShadingVertex vertex;
    if (has_normals_) vertex.normal = pack_normal(source_.corner_normal[corner]);
    if (has_uv_) vertex.uv = source_.corner_uv[corner] + 0.0f;  // no -0, which would be another vertex
    if (has_colors_) vertex.color = pack_vertex_color(source_.corner_color[corner]);
    auto& same_hash = by_hash_[hash_values<ShadingVertex>({&vertex, 1})];
    for (const uint32_t number : same_hash) {
      if (is_same(number, vertex)) return number;
    }
    same_hash.push_back(count_);
    if (has_normals_) level_.shading_normal.push_back(vertex.normal);
    if (has_uv_) level_.shading_uv.push_back(vertex.uv);
    if (has_colors_) level_.shading_color.push_back(vertex.color);
    return count_++;
  }

 private:
  bool is_same(uint32_t number, const ShadingVertex& vertex) const {
    return (!has_normals_ || level_.shading_normal[number] == vertex.normal) &&
           (!has_uv_ || level_.shading_uv[number] == vertex.uv) &&
           (!has_colors_ || level_.shading_color[number] == vertex.color);
  }

  const SourceSurface& source_;
  LevelData& level_;
  bool has_normals_, has_uv_, has_colors_;
  uint32_t count_ = 0;
  std::unordered_map<uint64_t, std::vector<uint32_t>> by_hash_;
};

/// Which of the triangle's corners the face starts with.
uint32_t turn_of(const SourceSurface& source, const SurfaceOrder& order, uint32_t triangle, const uvec3& face) {
  for (uint32_t turn = 0; turn < 3; ++turn) {
    if (order.vertex_number[source.triangles[triangle][static_cast<int>(turn)]] == face.x) return turn;
  }
  FARFIELD_CHECK(false);
  return 0;
}

}  // namespace

void pack_source(const SourceSurface& source, const SurfaceOrder& order, const Surface& ordered, LevelData& level) {
  std::vector<uint32_t> triangle_of(source.triangles.size());  // per face
  for (uint32_t t = 0; t < triangle_of.size(); ++t) triangle_of[order.face_number[t]] = t;
  const std::vector<uvec3>& faces = ordered.triangles;
  std::vector<uint32_t> turn(faces.size());
  for (size_t f = 0; f < faces.size(); ++f) turn[f] = turn_of(source, order, triangle_of[f], faces[f]);

  CornerPacker packer(source, level);
  const bool has_materials = std::ranges::any_of(source.material, [](uint32_t m) { return m != 0; });
  if (has_materials) {
    for (const uint32_t t : triangle_of) level.face_material.push_back(static_cast<uint16_t>(source.material[t]));
  }
  if (has_materials || source.material_function || packer.has_texture_coordinates_or_colors()) {
    for (size_t f = 0; f < faces.size(); ++f) {
      level.source_face.push_back(source.source_face[triangle_of[f]] << kSourceTurnBits | turn[f]);
    }
  }
  if (!packer.has_any()) return;
  for (size_t f = 0; f < faces.size(); ++f) {
    uvec3 corners;
    for (uint32_t k = 0; k < 3; ++k) {
      corners[static_cast<int>(k)] = packer.vertex_of(3 * size_t{triangle_of[f]} + (turn[f] + k) % 3);
    }
    level.corner_vertex.push_back(corners);
  }
}

}  // namespace farfield
