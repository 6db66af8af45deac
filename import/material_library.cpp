// SPDX-License-Identifier: Apache-2.0
#include "import/material_library.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "import/derived_maps.h"
#include "import/text_cursor.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

float unit(float value) { return std::clamp(value, 0.0f, 1.0f); }

/// Pr and Pm (the PBR extension) say it directly. Otherwise Blender writes its specular slider as Ks, F0 = 0.08 Ks, and
/// Ns = 1000 (1 - roughness)^2. Other programs mean Phong's strength and exponent: a strength is no reflectance at
/// normal incidence, and 1 is what kits write on wood, so it scales the F0 of a dielectric, 0.04;
/// alpha^2 = 2 / (Ns + 2) [Walter et al. 2007], where alpha = roughness^2. Only the mirrors among the illumination
/// models (3, 4, 6, 8, 9: reflection without Fresnel) mean Ks as it stands. illum 0 and 1 have no highlight.
void set_specular(const MtlMaterial& mtl, bool is_from_blender, SourceMaterial& out) {
  const vec3 ks = mtl.ks.value_or(vec3(0.0f));
  const float ns = std::clamp(mtl.ns.value_or(0.0f), 0.0f, 1e6f);
  const int illum = mtl.illum.value_or(2);
  const float phong_roughness = std::pow(2.0f / (ns + 2.0f), 0.25f);
  if (mtl.pr || mtl.pm || mtl.map_pr || mtl.map_pm) {
    out.roughness = mtl.pr ? unit(*mtl.pr) : mtl.map_pr ? 1.0f : phong_roughness;
    out.metallic = mtl.pm ? unit(*mtl.pm) : mtl.map_pm ? 1.0f : 0.0f;
    out.dielectric_f0 = vec3(0.04f);
  } else if (illum <= 1) {
    out.dielectric_f0 = vec3(0.0f);
  } else if (is_from_blender) {
    out.roughness = 1.0f - std::sqrt(std::min(ns, 1000.0f) / 1000.0f);
    out.dielectric_f0 = vec3(0.08f * (ks.x + ks.y + ks.z) / 3.0f);
  } else {
    const bool is_mirror = illum == 3 || illum == 4 || illum == 6 || illum == 8 || illum == 9;
    out.roughness = phong_roughness;
    out.dielectric_f0 = is_mirror ? ks : 0.04f * ks;
  }
}

/// Whether an image's alpha leaves something and takes something: then it is a mask, and no forgotten channel.
bool is_mask(const Texture& image, float cutoff) {
  const Texture::Level& level = image.level(0);
  const auto is_open = [&](const auto& texel) { return texel[3] >= 65535.0f * cutoff; };
  return std::any_of(level.texels.begin(), level.texels.end(), is_open) &&
         !std::all_of(level.texels.begin(), level.texels.end(), is_open);
}

}  // namespace

void MaterialLibraries::load(std::string_view names) {
  const fs::path named = folder_ / with_slashes(names);
  if (load_file(named)) return;
  if (const fs::path other = find_by_last_name(folder_, named); !other.empty() && load_file(other)) {
    warn(fmt::format("material library {}: not there; {} is taken", names, other.string()));
    return;
  }
  TextCursor words(names);
  for (auto word = words.word(); !word.empty(); word = words.word()) {
    if (!load_file(folder_ / with_slashes(word))) warn(fmt::format("material library {} cannot be read", word));
  }
}

bool MaterialLibraries::load_file(const fs::path& path) {
  if (files_.contains(path.string())) return true;
  auto bytes = images_.read_noted(path);
  if (!bytes) bytes = images_.read_noted(path.string() + ".gz");
  if (!bytes) return false;
  files_.insert(path.string());
  MtlFile file = read_mtl({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, path.string());
  for (std::string& warning : file.warnings) warn(std::move(warning));
  for (MtlMaterial& mtl : file.materials) entries_.push_back({std::move(mtl), path, file.is_from_blender});
  return true;
}

uint32_t MaterialLibraries::find(std::string_view name) {
  const auto found = by_name_.find(name);
  if (found != by_name_.end()) return found->second;
  const auto index = static_cast<uint32_t>(mesh_.materials.size());
  mesh_.materials.emplace_back();
  uv_.emplace_back();
  return by_name_.emplace(std::string(name), index).first->second;
}

Result<void> MaterialLibraries::finish() {
  std::map<std::string_view, const Entry*> latest;  // of several definitions the last one holds
  for (const Entry& entry : entries_) latest[entry.mtl.name] = &entry;
  for (const Entry& entry : entries_) {
    const auto used = by_name_.find(entry.mtl.name);
    if (used == by_name_.end() || latest[entry.mtl.name] != &entry) continue;
    set(used->second, entry);
  }
  for (const auto& [name, index] : by_name_) {
    const std::string wanted = lower_case(name);
    if (name.empty() || latest.contains(name)) continue;
    const auto similar =
        std::ranges::find_if(latest, [&](const auto& entry) { return lower_case(entry.first) == wanted; });
    if (similar != latest.end()) {
      warn(fmt::format("material {} is taken for {}, which differs in upper and lower case", name, similar->first));
      set(index, *similar->second);
      continue;
    }
    warn(fmt::format("material {} is not in any library that was read; default grey", name));
  }
  keep_what_would_vanish();
  return images_.ready();
}

void MaterialLibraries::set(uint32_t material, const Entry& entry) {
  mesh_.materials[material] = convert(entry, uv_[material]);
  defined_.insert(material);
  SourceHeights displacement = heights(entry);
  if (!displacement) return;
  mesh_.heights.resize(mesh_.materials.size());
  mesh_.heights[material] = std::move(displacement);
}

SourceMaterial MaterialLibraries::convert(const Entry& entry, UvTransform& uv) {
  const MtlMaterial& mtl = entry.mtl;
  SourceMaterial out;
  out.name = mtl.name;
  set_specular(mtl, entry.is_from_blender, out);
  set_alpha(entry, out);
  set_color(entry, out);
  set_metallic_roughness_map(entry, out);
  set_emission(entry, out);
  set_normals(entry, out);
  const MtlMap* first = nullptr;
  for (const MtlMap* map :
       {&mtl.map_kd, &mtl.map_pr, &mtl.map_pm, &mtl.map_d, &mtl.map_ke, &mtl.norm, &mtl.bump, &mtl.disp}) {
    if (!*map) continue;
    if (!first) first = map;
    if (map->scale != first->scale || map->offset != first->offset) {
      warn(fmt::format("material {}: its textures differ in -s or -o; those of {} are used", mtl.name, first->file));
    }
  }
  if (first) uv = {first->scale, first->offset};
  const int illum = mtl.illum.value_or(2);
  if (illum >= 4 && illum != 5 && illum != 8 && mtl.has_transmission_filter) {
    warn(fmt::format("material {}: transmission filter (Tf) is ignored", mtl.name));
  }
  if (!mtl.not_modelled.empty()) {
    warn(fmt::format("{}: material {}: {} ignored: not modelled", entry.file.string(), mtl.name,
                     fmt::join(mtl.not_modelled, ", ")));
  }
  return out;
}

/// Photogrammetry tools write Tr 1 and mean opaque. It means transparent only where the same file shows that it knows:
/// another material with a Tr below a half.
bool MaterialLibraries::zero_means_opaque() const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [](const Entry& entry) { return entry.mtl.tr && *entry.mtl.tr < 0.5f; });
}

void MaterialLibraries::set_alpha(const Entry& entry, SourceMaterial& out) {
  const MtlMaterial& mtl = entry.mtl;
  out.alpha = unit(mtl.d ? *mtl.d : 1.0f - mtl.tr.value_or(0.0f));
  if (!mtl.d && mtl.tr && *mtl.tr >= 1 && !zero_means_opaque()) {
    out.alpha = 1;
    warn(fmt::format("material {}: Tr 1 alone is taken for opaque; write d 0 for what is not to be seen", mtl.name));
  }
  if (mtl.map_d) {
    out.alpha_map = mask(entry, mtl.map_d);
    if (out.alpha_map) out.alpha_mode = AlphaMode::Mask;
    if (out.alpha_mode != AlphaMode::Opaque && out.alpha < out.alpha_cutoff) {
      warn(fmt::format("material {}: dissolve {} beside an opacity map would leave nothing; the map alone is used",
                       mtl.name, out.alpha));
      out.alpha = 1;
    }
  }
  if (out.alpha < 1.0f && out.alpha_mode == AlphaMode::Opaque) out.alpha_mode = AlphaMode::Blend;
}

/// A map multiplies Kd, and Kd is white without one: not black, as a missing number reads. Its file's own alpha is cut
/// out where nothing else says what is to be seen.
void MaterialLibraries::set_color(const Entry& entry, SourceMaterial& out) {
  const MtlMaterial& mtl = entry.mtl;
  if (mtl.kd) out.base_color = *mtl.kd;
  if (!mtl.map_kd) return;
  const bool may_have_mask = !mtl.map_d && out.alpha_mode == AlphaMode::Opaque;
  out.base_color_map = texture(entry, mtl.map_kd, may_have_mask ? TextureUse::ColorWithAlpha : TextureUse::Color);
  if (!out.base_color_map) return;
  if (!mtl.kd) out.base_color = vec3(1.0f);
  if (mtl.kd == vec3(0.0f)) {
    out.base_color = vec3(1.0f);
    warn(fmt::format("material {}: Kd 0 beside map_Kd would be black; the map alone is used", mtl.name));
  }
  if (!may_have_mask || out.base_color_map.image->mean().w == 1) return;
  if (is_mask(*out.base_color_map.image, out.alpha_cutoff)) {
    out.alpha_mode = AlphaMode::Mask;
    warn(
        fmt::format("material {}: cut out by the alpha in {}, which no map_d names; save that file without alpha if it "
                    "is to be solid",
                    mtl.name, mtl.map_kd.file));
  } else {
    out.base_color_map = texture(entry, mtl.map_kd, TextureUse::Color);
    warn(fmt::format("material {}: the alpha in {} is no mask; ignored", mtl.name, mtl.map_kd.file));
  }
}

void MaterialLibraries::set_metallic_roughness_map(const Entry& entry, SourceMaterial& out) {
  const MtlMaterial& mtl = entry.mtl;
  if (!mtl.map_pr && !mtl.map_pm) return;
  const SourceTexture roughness = mtl.map_pr ? texture(entry, mtl.map_pr, TextureUse::Data) : SourceTexture{};
  const SourceTexture metallic = mtl.map_pm ? texture(entry, mtl.map_pm, TextureUse::Data) : SourceTexture{};
  const bool is_missing = roughness.is_missing || metallic.is_missing;
  out.metallic_roughness_map = roughness ? roughness : metallic;
  out.metallic_roughness_map.is_missing = is_missing;
  if (!roughness && !metallic) return;
  if (metallic && out.metallic == 0) warn(fmt::format("material {}: Pm 0 switches map_Pm off", mtl.name));
  if (roughness && out.roughness == 0) warn(fmt::format("material {}: Pr 0 switches map_Pr off", mtl.name));
  out.metallic_roughness_map.image = std::make_shared<const Texture>(
      pack_metallic_roughness(roughness.image.get(), mtl.map_pr.channel, metallic.image.get(), mtl.map_pm.channel));
}

/// A map multiplies Ke, and Ke is white without one.
void MaterialLibraries::set_emission(const Entry& entry, SourceMaterial& out) {
  const MtlMaterial& mtl = entry.mtl;
  out.emission = mtl.ke.value_or(vec3(mtl.map_ke ? 1.0f : 0.0f));
  if (!mtl.map_ke) return;
  if (out.emission == vec3(0.0f)) {
    warn(fmt::format("material {}: Ke 0 switches map_Ke off", mtl.name));
    return;
  }
  out.emission_map = texture(entry, mtl.map_ke, TextureUse::Color);
  if (!out.emission_map && !mtl.ke) out.emission = vec3(0.0f);
}

/// A normal map, or one made of heights. Blender and others write normal maps as map_Bump: their colour shows it.
void MaterialLibraries::set_normals(const Entry& entry, SourceMaterial& out) {
  const MtlMaterial& mtl = entry.mtl;
  const MtlMap& map = mtl.norm ? mtl.norm : mtl.bump;
  if (!map) return;
  if (!mtl.norm && mtl.disp && mtl.disp.file == mtl.bump.file) {
    warn(fmt::format("material {}: bump is the map of disp, which moves the surface itself; ignored", mtl.name));
    return;
  }
  out.normal_map = texture(entry, map, TextureUse::Data);
  if (!out.normal_map) return;
  if (mtl.norm && mtl.bump && mtl.bump.file != mtl.norm.file) {
    warn(fmt::format("material {}: bump is ignored beside norm", mtl.name));
  }
  if (mtl.norm || looks_like_normals(*out.normal_map.image)) {
    out.normal_scale = map.bump_scale;
    if (!mtl.norm)
      warn(fmt::format("material {}: bump {} is a normal map by its colours; read as such", mtl.name, map.file));
    return;
  }
  out.normal_map.image = std::make_shared<const Texture>(
      normals_of_heights(*out.normal_map.image, map.channel, map.bump_scale, out.normal_map.wrap_u));
}

/// Heights are -bm * (base + gain * texel), with base and gain of -mm, in the file's units.
SourceHeights MaterialLibraries::heights(const Entry& entry) {
  const MtlMap& map = entry.mtl.disp;
  if (!map) return {};
  SourceHeights out;
  out.map = images_.read_heights(entry.file.parent_path(), map.file, map.channel);
  out.name = map.file;
  if (map.is_clamped) out.wrap_u = out.wrap_v = Wrap::Clamp;
  out.gain = map.bump_scale * map.gain;
  out.base = map.bump_scale * map.base;
  return out;
}

/// What map_d says, from the channel that -imfchan names.
SourceTexture MaterialLibraries::mask(const Entry& entry, const MtlMap& map) {
  if (map.channel == 0 || map.channel == 'm') return texture(entry, map, TextureUse::Mask);
  SourceTexture out = texture(entry, map, TextureUse::Data);
  if (out) out.image = std::make_shared<const Texture>(mask_of_channel(*out.image, map.channel));
  return out;
}

SourceTexture MaterialLibraries::texture(const Entry& entry, const MtlMap& map, TextureUse use) {
  SourceTexture out;
  out.image = images_.read(entry.file.parent_path(), map.file, use);
  out.is_missing = !out.image;
  if (map.is_clamped) out.wrap_u = out.wrap_v = Wrap::Clamp;
  return out;
}

/// A file of which nothing would be left says it wrongly, as exporters do that write d for Tr.
void MaterialLibraries::keep_what_would_vanish() {
  const auto vanishes = [](const SourceMaterial& m) {
    return m.alpha == 0 || (m.alpha_mode == AlphaMode::Mask && m.alpha < m.alpha_cutoff);
  };
  if (mesh_.face_count() == 0) return;
  if (!std::all_of(mesh_.face_material.begin(), mesh_.face_material.end(),
                   [&](uint32_t index) { return vanishes(mesh_.materials[index]); })) {
    return;
  }
  warn("every material is transparent (d, Tr) and nothing would be left; all are taken for opaque");
  for (SourceMaterial& m : mesh_.materials) m.alpha = 1;
}

}  // namespace farfield
