// SPDX-License-Identifier: Apache-2.0
#include "runtime/close_up.h"

#include <algorithm>
#include <cmath>

#include "scattering/material_model.h"
#include "scattering/tangent_frame.h"

namespace farfield {
namespace {

constexpr float kMaxUv = 1e6f;           // beyond, float has no texels any more
constexpr float kLongestStretch = 16;    // of a footprint at grazing angles
constexpr float kUnevenLengths = 0.01f;  // normals in files are rounded: no spread

template <typename T>
T interpolate(ArrayView<T> values, const uvec3& corners, vec2 b) {
  return (1 - b.x - b.y) * values[corners.x] + b.x * values[corners.y] + b.y * values[corners.z];
}

vec3 interpolate_normals(const LevelView& level, const uvec3& corners, vec2 b) {
  const auto at = [&](uint32_t i) { return unpack_normal(level.shading_normal[i]); };
  const vec3 normal = (1 - b.x - b.y) * at(corners.x) + b.x * at(corners.y) + b.y * at(corners.z);
  const float length = glm::length(normal);
  return length > 1e-6f ? normal / length : vec3(0.0f);
}

vec4 interpolate_colors(const LevelView& level, const uvec3& corners, vec2 b) {
  const auto at = [&](uint32_t i) { return unpack_vertex_color(level.shading_color[i]); };
  return (1 - b.x - b.y) * at(corners.x) + b.x * at(corners.y) + b.y * at(corners.z);
}

/// The quad that holds a face: faces are numbered along them.
uvec3 triangle_of(const LevelView& level, uint32_t face) {
  const auto after = std::ranges::upper_bound(level.quad_first_face, face);
  const auto quad_index = static_cast<size_t>(after - level.quad_first_face.begin()) - 1;
  const Quad& quad = level.quads[quad_index];
  return face == level.quad_first_face[quad_index] ? uvec3(quad.v0, quad.v1, quad.v3)
                                                   : uvec3(quad.v2, quad.v3, quad.v1);
}

}  // namespace

/// A point with what lookups need to know of it.
struct CloseUp::Place {
  SourcePoint at;
  vec4 color{1.0f};
  std::array<vec3, 3> positions{};  ///< of the triangle; only with texture coordinates
  std::array<vec2, 3> uvs{};
  vec2 duv_dx{0.0f}, duv_dy{0.0f};  ///< the whole way across the footprint
  bool has_uv = false;              ///< usable ones

  Place(const LevelView& level, const SurfacePoint& point) : at(source_point(level, point.face, point.barycentric)) {
    if (level.corner_vertex.empty()) return;
    const uvec3& corners = level.corner_vertex[point.face];
    if (!level.shading_color.empty()) color = interpolate_colors(level, corners, point.barycentric);
    if (level.shading_uv.empty()) return;
    const uvec3 triangle = triangle_of(level, point.face);
    for (size_t k = 0; k < 3; ++k) {
      positions[k] = level.positions[triangle[static_cast<int>(k)]];
      uvs[k] = level.shading_uv[corners[static_cast<int>(k)]];
    }
    has_uv =
        std::ranges::all_of(uvs, [](const vec2& uv) { return std::abs(uv.x) <= kMaxUv && std::abs(uv.y) <= kMaxUv; });
    if (has_uv) set_footprint(point);
  }

  /// The ellipse in which a cone meets the triangle's plane, in texture coordinates.
  void set_footprint(const SurfacePoint& point) {
    const vec3 edge1 = positions[1] - positions[0], edge2 = positions[2] - positions[0];
    const vec3 normal = glm::cross(edge1, edge2);
    const float area2 = glm::dot(normal, normal), length = glm::length(point.direction);
    if (!(area2 > 0) || !(length > 0) || !(point.width > 0)) return;
    const vec3 unit_normal = normal / std::sqrt(area2), direction = point.direction / length;
    const float cosine = std::abs(glm::dot(unit_normal, direction));
    vec3 along = direction - unit_normal * glm::dot(unit_normal, direction);
    const float along_length = glm::length(along);
    along = along_length > 1e-4f ? along / along_length : edge1 / glm::length(edge1);
    const vec3 across = glm::cross(unit_normal, along);
    const vec2 uv1 = uvs[1] - uvs[0], uv2 = uvs[2] - uvs[0];
    const auto in_uv = [&](const vec3& way) {
      const float b1 = glm::dot(glm::cross(way, edge2), normal) / area2;
      const float b2 = glm::dot(glm::cross(edge1, way), normal) / area2;
      return b1 * uv1 + b2 * uv2;
    };
    duv_dx = in_uv(across * point.width);
    duv_dy = in_uv(along * (point.width / std::max(cosine, 1 / kLongestStretch)));
    if (!std::isfinite(duv_dx.x + duv_dx.y + duv_dy.x + duv_dy.y)) duv_dx = duv_dy = vec2(0.0f);
  }

  /// How many of the map's texels the footprint is wide, along its longer axis.
  float width_in_texels(vec2 map_size) const {
    return std::max(glm::length(duv_dx * map_size), glm::length(duv_dy * map_size));
  }
};

SourcePoint source_point(const LevelView& level, uint32_t face, vec2 barycentric) {
  SourcePoint point;
  if (!level.face_material.empty()) point.material = level.face_material[face];
  point.barycentric = barycentric;
  if (!level.source_face.empty()) {
    point.source_face = level.source_face[face] >> kSourceTurnBits;
    const vec3 weights(1 - barycentric.x - barycentric.y, barycentric.x, barycentric.y);
    const int turn = static_cast<int>(level.source_face[face] & ((1u << kSourceTurnBits) - 1));  // 3 in damaged files
    point.barycentric = {weights[(4 - turn) % 3], weights[(5 - turn) % 3]};
  }
  if (level.corner_vertex.empty()) return point;
  const uvec3& corners = level.corner_vertex[face];
  if (!level.shading_uv.empty()) point.uv = interpolate(level.shading_uv, corners, barycentric);
  if (!level.shading_normal.empty()) point.normal = interpolate_normals(level, corners, barycentric);
  return point;
}

CloseUp::CloseUp(const std::filesystem::path& folder, const Manifest& manifest, MaterialFunction function,
                 TextureCache& textures)
    : function_(std::move(function)), textures_(textures) {
  const auto open = [&](const TextureRef& map) {
    if (!map) return Map{};
    const AssetTexture& texture = manifest.textures[map.texture];
    return Map{textures.add(folder / texture.file, map.wrap_u, map.wrap_v), static_cast<int>(texture.channels),
               vec2(texture.width, texture.height)};
  };
  for (const AssetMaterial& from : manifest.materials) {
    Material& to = materials_.emplace_back();
    static_cast<MaterialFactors&>(to) = from;
    to.base_color_map = open(from.base_color_map);
    to.metallic_roughness_map = open(from.metallic_roughness_map);
    to.alpha_map = open(from.alpha_map);
    to.normal_map = open(from.normal_map);
    to.emission_map = open(from.emission_map);
    to.mask_map = open(from.mask_map);
    to.has_maps = to.base_color_map || to.metallic_roughness_map || to.alpha_map || to.normal_map || to.emission_map ||
                  to.mask_map;
    has_maps_ |= to.has_maps;
  }
  for (const AssetTexture& texture : manifest.textures) textures.add_bytes(texture.cache_bytes);
}

float CloseUp::opacity(const TracedLevel& level, const SurfacePoint& point) const {
  const Place place(level.view, point);
  std::optional<float> opacity;
  if (function_) {
    opacity = ask_host(place, true).opacity;
  } else if (const Material* material = varying_material(level.view, place)) {
    opacity = opacity_at(*material, place);
  }
  return opacity ? *opacity : unpack_unorm8(level.view.face_opacity[point.face]);
}

std::optional<CloseUpSample> CloseUp::sample(const LevelView& level, const SurfacePoint& point) const {
  const bool is_plain = !function_ && !has_maps_ && level.corner_vertex.empty();
  if (is_plain) return {};
  const Place place(level, point);
  std::optional<MaterialSample> material;
  if (function_) {
    material = ask_host(place, false);
  } else if (const Material* varying = varying_material(level, place)) {
    material = sample_at(*varying, place);
  }
  if (!material) return {};
  CloseUpSample out{*material, place.at.normal};
  if (place.has_uv && (material->normal.x != 0 || material->normal.y != 0)) {
    vec3 smooth = place.at.normal;
    if (smooth == vec3(0.0f)) {
      const auto& p = place.positions;
      smooth = glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0]));
    }
    out.normal = TangentFrame(place.positions, place.uvs).bend(smooth, material->normal);
  }
  return out;
}

/// The material of a place, if it says more there than what the face is on average.
const CloseUp::Material* CloseUp::varying_material(const LevelView& level, const Place& place) const {
  if (place.at.material >= materials_.size()) return nullptr;
  const Material& material = materials_[place.at.material];
  const bool is_varying = material.has_maps ? place.has_uv : !level.shading_color.empty();
  return is_varying ? &material : nullptr;
}

/// Nothing: a map that is needed cannot be read.
std::optional<float> CloseUp::opacity_at(const Material& m, const Place& place) const {
  const float own = m.alpha * place.color.w;
  if (m.alpha_mode == AlphaMode::Opaque) return 1.0f;
  if (m.alpha_mode == AlphaMode::Mask) {
    if (!m.mask_map) return own >= m.alpha_cutoff ? 1.0f : 0.0f;
    vec4 mask;
    if (!look_up(m.mask_map, place, mask)) return {};
    const float inside = mask.x * own >= m.alpha_cutoff ? 1.0f : 0.0f;
    // What is wider than a texel sees averages: of these coverage tells the share.
    return glm::mix(inside, mask.y, std::clamp(place.width_in_texels(m.mask_map.size) - 1, 0.0f, 1.0f));
  }
  float alpha = own;
  for (const Map* map : {&m.base_color_map, &m.alpha_map}) {
    vec4 value;
    if (!*map || (map == &m.base_color_map && map->channels < 4)) continue;
    if (!look_up(*map, place, value)) return {};
    alpha *= map == &m.base_color_map ? value.w : value.x;
  }
  return std::clamp(alpha, 0.0f, 1.0f);
}

/// Nothing: a map that is needed cannot be read.
std::optional<MaterialSample> CloseUp::sample_at(const Material& m, const Place& place) const {
  MapMeans means = means_without_maps(m, place.color.w);
  float roughness = m.roughness;
  vec4 value;
  if (m.metallic_roughness_map) {
    if (!look_up(m.metallic_roughness_map, place, value)) return {};
    roughness *= value.y;
    means.metallic = m.metallic * value.z;
  }
  means.roughness2 = roughness * roughness * roughness * roughness;
  vec3 base(1.0f);
  if (m.base_color_map) {
    if (!look_up(m.base_color_map, place, value)) return {};
    base = m.base_color_map.channels < 4 ? vec3(value) : vec3(value) / std::max(value.w, 1e-4f);
  }
  means.dielectric = base * (1 - means.metallic);
  means.metal = base * means.metallic;
  if (m.emission_map) {
    if (!look_up(m.emission_map, place, value)) return {};
    means.emission = vec3(value);
  }
  if (m.normal_map) {
    if (!look_up(m.normal_map, place, value)) return {};
    means.normal = (2.0f * vec3(value) - 1.0f) * vec3(m.normal_scale, m.normal_scale, 1);
    const float length2 = glm::dot(means.normal, means.normal);
    const float aside = std::clamp(0.5f * (1 - length2) - kUnevenLengths, 0.0f, 1.0f / 3);
    means.roughness2 = std::min(means.roughness2 + aside / (1 - 2 * aside), 1.0f);
  }
  return material_sample(m, means, vec3(place.color));
}

MaterialSample CloseUp::ask_host(const Place& place, bool opacity_only) const {
  MaterialQuery query;
  query.material = place.at.material;
  query.face = place.at.source_face;
  query.uv = place.at.uv;
  query.duv_dx = 0.5f * place.duv_dx;
  query.duv_dy = 0.5f * place.duv_dy;
  query.color = place.color;
  query.opacity_only = opacity_only;
  return in_range(function_(query));
}

bool CloseUp::look_up(const Map& map, const Place& place, vec4& value) const {
  if (!place.has_uv) return false;
  const vec2 uv = place.at.uv;
  value = vec4(0, 0, 0, 1);
  return textures_.look_up(map.texture, {uv.x, uv.y, place.duv_dx.x, place.duv_dx.y, place.duv_dy.x, place.duv_dy.y},
                           map.channels, &value.x);
}

const std::string& CloseUp::material_name(uint32_t material) const {
  static const std::string none;
  return material < materials_.size() ? materials_[material].name : none;
}

bool CloseUp::has_textures() const { return !function_ && has_maps_; }

uint64_t CloseUp::table_bytes() const { return sizeof(CloseUp) + materials_.capacity() * sizeof(Material); }

}  // namespace farfield
