// SPDX-License-Identifier: Apache-2.0
#include "runtime/close_up.h"

#include <algorithm>
#include <cmath>

#include "scattering/material_model.h"
#include "scattering/tangent_frame.h"

namespace farfield {
namespace {

constexpr float kLongestStretch = 16;  // of a footprint at grazing angles
// The share of a ray's width over which maps are averaged: a pixel has many rays, and MIP levels of an atlas mix what
// lies side by side there only. Over whole widths a cow's hooves turn as white as the margin around them, and it is 3 %
// too bright at 16 pixels, 6 % at 8 (docs/results/textures.md). Smaller shares page in finer texels.
constexpr float kMapShare = 0.25f;
// The same for masks. Averages over whole cones forget which leaf hides which, and crowns of leaf cards darken by 2 %
// (docs/results/cycles.md).
constexpr float kMaskShare = 0.0625f;
constexpr float kUnevenLengths = 0.01f;  // normals in files are rounded: no spread

/// Between a face's corners; at(i) gives shading vertex i.
template <typename At>
auto interpolate(const uvec3& corners, vec2 b, const At& at) {
  return (1 - b.x - b.y) * at(corners.x) + b.x * at(corners.y) + b.y * at(corners.z);
}

vec3 interpolate_normals(const LevelView& level, const uvec3& corners, vec2 b) {
  const vec3 normal = interpolate(corners, b, [&](uint32_t i) { return unpack_normal(level.shading_normal[i]); });
  const float length = glm::length(normal);
  return length > 1e-6f ? normal / length : vec3(0.0f);
}

/// The point in the terms of the source.
SourcePoint source_point(const LevelView& level, const SurfacePoint& point) {
  const uint32_t face = point.face;
  const vec2 b = point.barycentric;
  SourcePoint out;
  if (!level.face_material.empty()) out.material = level.face_material[face];
  out.barycentric = b;
  if (!level.source_face.empty()) {
    out.source_face = level.source_face[face] >> kSourceTurnBits;
    const vec3 weights(1 - b.x - b.y, b.x, b.y);
    const int turn = static_cast<int>(level.source_face[face] & ((1u << kSourceTurnBits) - 1));  // 3 in damaged files
    out.barycentric = {weights[(4 - turn) % 3], weights[(5 - turn) % 3]};
  }
  if (level.corner_vertex.empty()) return out;
  const uvec3& corners = level.corner_vertex[face];
  if (!level.shading_uv.empty()) out.uv = interpolate(corners, b, [&](uint32_t i) { return level.shading_uv[i]; });
  if (!level.shading_normal.empty()) out.normal = interpolate_normals(level, corners, b);
  return out;
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

  /// share: of the ray's width, over which maps are averaged.
  Place(const LevelView& level, const SurfacePoint& point, float share) : at(source_point(level, point)) {
    if (level.corner_vertex.empty()) return;
    const uvec3& corners = level.corner_vertex[point.face];
    if (!level.shading_color.empty()) {
      color = interpolate(corners, point.barycentric,
                          [&](uint32_t i) { return unpack_vertex_color(level.shading_color[i]); });
    }
    if (level.shading_uv.empty()) return;
    const uvec3 triangle = level.quads[point.quad].face(point.face - level.quad_first_face[point.quad]);
    for (size_t k = 0; k < 3; ++k) {
      positions[k] = level.positions[triangle[static_cast<int>(k)]];
      uvs[k] = level.shading_uv[corners[static_cast<int>(k)]];
    }
    has_uv = std::ranges::all_of(uvs, is_usable_uv);
    if (has_uv) set_footprint(point, point.width * share);
  }

  /// The ellipse in which a cone meets the triangle's plane, in texture coordinates.
  void set_footprint(const SurfacePoint& point, float width) {
    const vec3 edge1 = positions[1] - positions[0], edge2 = positions[2] - positions[0];
    const vec3 normal = glm::cross(edge1, edge2);
    const float area2 = glm::dot(normal, normal), length = glm::length(point.direction);
    if (!(area2 > 0) || !(length > 0) || !(width > 0)) return;
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
    duv_dx = in_uv(across * width);
    duv_dy = in_uv(along * (width / std::max(cosine, 1 / kLongestStretch)));
    if (!std::isfinite(duv_dx.x + duv_dx.y + duv_dy.x + duv_dy.y)) duv_dx = duv_dy = vec2(0.0f);
  }

  /// How many of the map's texels the footprint is wide, along its longer axis.
  float width_in_texels(vec2 map_size) const {
    return std::max(glm::length(duv_dx * map_size), glm::length(duv_dy * map_size));
  }
};

CloseUp::CloseUp(const std::filesystem::path& folder, const Manifest& manifest, MaterialFunction function,
                 TextureCache& textures)
    : function_(std::move(function)), textures_(textures) {
  const auto open = [&](const TextureRef& map) {
    if (!map) return Map{};
    const AssetTexture& texture = manifest.textures[map.texture];
    return Map{textures.add(folder, texture, map.wrap_u, map.wrap_v), static_cast<int>(texture.channels),
               vec2(texture.width, texture.height)};
  };
  for (const AssetMaterial& from : manifest.materials) {
    Material& to = materials_.emplace_back();
    static_cast<MaterialFactors&>(to) = from;
    for (size_t i = 0; i < to.maps().size(); ++i) *to.maps()[i] = open(*from.maps()[i]);
    to.mask_map = open(from.mask_map);
    to.has_maps = to.mask_map || std::ranges::any_of(to.maps(), [](const Map* map) { return bool(*map); });
    has_maps_ |= to.has_maps;
  }
}

float CloseUp::opacity(const LevelView& level, const SurfacePoint& point) const {
  const Place place(level, point, kMaskShare);
  std::optional<float> opacity;
  if (function_) {
    opacity = ask_host(place, true).opacity;
  } else if (const Material* material = varying_material(level, place)) {
    opacity = opacity_at(*material, place);
  }
  return opacity ? *opacity : unpack_unorm8(level.face_opacity[point.face]);
}

CloseUpSample CloseUp::sample(const LevelView& level, const SurfacePoint& point) const {
  const Place place(level, point, kMapShare);
  CloseUpSample out{place.at, {}};
  if (function_) {
    out.material = ask_host(place, false);
  } else if (const Material* varying = varying_material(level, place)) {
    out.material = sample_at(*varying, place);
  }
  if (out.material && place.has_uv) out.at.normal = mapped(place, out.material->normal);
  return out;
}

/// The shading normal, bent as a normal in the tangent frame says.
vec3 CloseUp::mapped(const Place& place, const vec3& in_frame) {
  vec3 smooth = place.at.normal;
  if (in_frame.x == 0 && in_frame.y == 0) return smooth;
  if (smooth == vec3(0.0f)) {
    const auto& p = place.positions;
    smooth = glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0]));
  }
  return TangentFrame(place.positions, place.uvs).bend(smooth, in_frame);
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
    means.normal = mapped_normal(vec3(value), m.normal_scale);
    const float length2 = glm::dot(means.normal, means.normal);
    const float aside = std::clamp(0.5f * (1 - length2) - kUnevenLengths, 0.0f, 1.0f / 3);
    means.roughness2 = std::min(means.roughness2 + roughness2_of_spread(aside), 1.0f);
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
