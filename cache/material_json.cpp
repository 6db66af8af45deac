// SPDX-License-Identifier: Apache-2.0
#include "cache/material_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "base/hash.h"

namespace farfield {
namespace {

constexpr size_t kMaxMaterials = 1 << 16;  // face_material has 16 bits
constexpr size_t kMaxTextures = 1 << 13;
constexpr uint32_t kMaxSide = 1 << 20;
constexpr uint64_t kMaxBytes = uint64_t{1} << 50;

constexpr std::array<std::string_view, 3> kWrapNames = {"repeat", "clamp", "mirror"};
constexpr std::array<std::string_view, 3> kAlphaNames = {"opaque", "mask", "blend"};

/// Calls visit(name, member) for everything of a material but its modes. Material: const or not.
template <typename Material, typename Visit>
void for_each_field(Material& m, const Visit& visit) {
  visit("name", m.name);
  visit("base_color", m.base_color);
  visit("alpha", m.alpha);
  visit("metallic", m.metallic);
  visit("roughness", m.roughness);
  visit("dielectric_f0", m.dielectric_f0);
  visit("diffuse_transmission", m.diffuse_transmission);
  visit("diffuse_transmission_color", m.diffuse_transmission_color);
  visit("alpha_cutoff", m.alpha_cutoff);
  visit("normal_scale", m.normal_scale);
  visit("emission", m.emission);
  visit("thin_transmission", m.thin_transmission);
  visit("base_color_map", m.base_color_map);
  visit("metallic_roughness_map", m.metallic_roughness_map);
  visit("alpha_map", m.alpha_map);
  visit("normal_map", m.normal_map);
  visit("emission_map", m.emission_map);
  visit("mask_map", m.mask_map);
}

template <typename Enum>
Enum enum_from_text(const std::string& text, const std::array<std::string_view, 3>& names, const std::string& where,
                    FieldReader& read) {
  const auto found = std::ranges::find(names, text);
  if (found == names.end() && !read.problem) read.problem = where + " is no known name";
  return static_cast<Enum>(found == names.end() ? 0 : found - names.begin());
}

/// Reads one field of a material; what is absent keeps its default.
struct FieldFromJson {
  const Json& json;
  const std::string& where;
  FieldReader& read;

  void operator()(const char* name, std::string& value) const {
    if (json.contains(name)) value = read.text(json, name, where);
  }
  void operator()(const char* name, float& value) const {
    if (json.contains(name)) value = static_cast<float>(read.number(json, name, where));
  }
  void operator()(const char* name, vec3& value) const {
    if (json.contains(name)) value = vec3(read.point(json, name, where));
  }
  void operator()(const char* name, TextureRef& value) const {
    if (!json.contains(name)) return;
    const Json& map = json[name];
    const std::string map_where = where + "." + name;
    value.texture = read.count32(map, "texture", map_where);
    value.wrap_u = enum_from_text<Wrap>(read.text(map, "wrap_u", map_where), kWrapNames, map_where, read);
    value.wrap_v = enum_from_text<Wrap>(read.text(map, "wrap_v", map_where), kWrapNames, map_where, read);
  }
};

/// Writes one field of a material.
struct FieldToJson {
  OrderedJson& json;

  void operator()(const char* name, const std::string& value) const { json[name] = value; }
  void operator()(const char* name, float value) const { json[name] = value; }
  void operator()(const char* name, const vec3& v) const { json[name] = {v.x, v.y, v.z}; }
  void operator()(const char* name, const TextureRef& map) const {
    if (!map) return;
    json[name] = {{"texture", map.texture},
                  {"wrap_u", kWrapNames[static_cast<size_t>(map.wrap_u)]},
                  {"wrap_v", kWrapNames[static_cast<size_t>(map.wrap_v)]}};
  }
};

/// What is wrong with one field of a material.
struct FieldProblem {
  size_t textures;
  Problem& problem;

  void operator()(const char*, const std::string&) const {}
  void operator()(const char* name, float value) const {
    if (!std::isfinite(value)) problem = fmt::format("{} is not finite", name);
  }
  void operator()(const char* name, const vec3& value) const {
    if (!is_finite(value)) problem = fmt::format("{} is not finite", name);
  }
  void operator()(const char* name, const TextureRef& map) const {
    if (map && map.texture >= textures) {
      problem = fmt::format("{} is texture {}, and there are {}", name, map.texture, textures);
    }
  }
};

AssetTexture texture_from_json(const Json& json, const std::string& where, FieldReader& read) {
  AssetTexture texture;
  texture.file = read.text(json, "file", where);
  texture.file_bytes = read.count(json, "file_bytes", where);
  texture.file_hash = read.hash(json, "file_hash", where);
  texture.width = read.count32(json, "width", where);
  texture.height = read.count32(json, "height", where);
  texture.channels = read.count32(json, "channels", where);
  texture.cache_bytes = read.count(json, "cache_bytes", where);
  return texture;
}

AssetMaterial material_from_json(const Json& json, const std::string& where, FieldReader& read) {
  AssetMaterial material;
  if (read.text(json, "name", where); read.problem) return material;  // an object, then
  for_each_field(material, FieldFromJson{json, where, read});
  material.alpha_mode =
      enum_from_text<AlphaMode>(read.text(json, "alpha_mode", where), kAlphaNames, where + ".alpha_mode", read);
  return material;
}

bool is_in_range(const AssetTexture& texture) {
  const auto is_side = [](uint32_t side) { return side >= 1 && side <= kMaxSide; };
  return is_side(texture.width) && is_side(texture.height) && texture.channels >= 1 && texture.channels <= 4 &&
         texture.file_bytes <= kMaxBytes && texture.cache_bytes <= kMaxBytes;
}

}  // namespace

std::vector<AssetTexture> textures_from_json(const Json& manifest, FieldReader& read) {
  std::vector<AssetTexture> textures;
  for (const Json& texture : read.array(manifest, "textures")) {
    if (read.problem || textures.size() > kMaxTextures) break;
    textures.push_back(texture_from_json(texture, fmt::format("textures[{}]", textures.size()), read));
  }
  return textures;
}

std::vector<AssetMaterial> materials_from_json(const Json& manifest, FieldReader& read) {
  std::vector<AssetMaterial> materials;
  for (const Json& material : read.array(manifest, "materials")) {
    if (read.problem || materials.size() > kMaxMaterials) break;
    materials.push_back(material_from_json(material, fmt::format("materials[{}]", materials.size()), read));
  }
  return materials;
}

OrderedJson to_json(const std::vector<AssetTexture>& textures) {
  OrderedJson json = OrderedJson::array();
  for (const AssetTexture& texture : textures) {
    json.push_back({{"file", texture.file},
                    {"file_bytes", texture.file_bytes},
                    {"file_hash", to_hex(texture.file_hash)},
                    {"width", texture.width},
                    {"height", texture.height},
                    {"channels", texture.channels},
                    {"cache_bytes", texture.cache_bytes}});
  }
  return json;
}

OrderedJson to_json(const std::vector<AssetMaterial>& materials) {
  OrderedJson json = OrderedJson::array();
  for (const AssetMaterial& material : materials) {
    OrderedJson one;
    for_each_field(material, FieldToJson{one});
    one["alpha_mode"] = kAlphaNames[static_cast<size_t>(material.alpha_mode)];
    json.push_back(std::move(one));
  }
  return json;
}

Problem find_material_problem(const Manifest& manifest) {
  if (manifest.textures.size() > kMaxTextures) return fmt::format("there are more than {} textures", kMaxTextures);
  if (manifest.materials.size() > kMaxMaterials) return fmt::format("there are more than {} materials", kMaxMaterials);
  for (size_t i = 0; i < manifest.textures.size(); ++i) {
    if (!is_in_range(manifest.textures[i])) return fmt::format("textures[{}]: its sizes are out of range", i);
  }
  for (size_t i = 0; i < manifest.materials.size(); ++i) {
    Problem problem;
    for_each_field(manifest.materials[i], FieldProblem{manifest.textures.size(), problem});
    if (problem) return fmt::format("materials[{}]: {}", i, *problem);
  }
  return {};
}

}  // namespace farfield
