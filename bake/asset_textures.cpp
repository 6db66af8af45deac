// SPDX-License-Identifier: Apache-2.0
#include "bake/asset_textures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <system_error>
#include <tuple>

#include "base/file_io.h"
#include "base/result.h"
#include "base/texture_module.h"
#include "prefilter/face_textures.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

/// Which channels of an image a map needs.
enum class MapUse { Color, Alpha, Mask };

/// As texture_write_oiio.cpp tiles them.
uint64_t tiled_bytes(int width, int height, uint64_t texel_bytes) {
  constexpr int kTile = 64;
  const auto tiles = [](int size) { return static_cast<uint64_t>((size + kTile - 1) / kTile); };
  return tiles(width) * tiles(height) * kTile * kTile * texel_bytes;
}

bool has_alpha(const Texture& image) {
  return std::ranges::any_of(image.level(0).texels, [](const auto& texel) { return texel[3] != 0xffff; });
}

/// The channels [first, first + count) of all sizes of an image.
std::vector<MipLevel> channels_of(const Texture& image, size_t first, size_t count) {
  std::vector<MipLevel> levels;
  for (int i = 0; i < image.level_count(); ++i) {
    const Texture::Level& level = image.level(i);
    MipLevel out{level.width, level.height, {}};
    out.values.reserve(count * level.texels.size());
    for (const auto& texel : level.texels) {
      for (size_t c = first; c < first + count; ++c) out.values.push_back(texel[c]);
    }
    levels.push_back(std::move(out));
  }
  return levels;
}

/// Whether eight bits hold the image: it came from such a file, and its values were not converted.
bool is_of_bytes(const MipLevel& level) {
  return std::ranges::all_of(level.values, [](uint16_t value) { return value % 257 == 0; });
}

/// The product of a masked material's alphas and, beside it, the share of each texel that the mask leaves.
Texture make_mask(const SourceMaterial& material) {
  constexpr int kSide = 4;  // points per texel and axis
  int width = 1, height = 1;
  for (const SourceTexture* map : {&material.base_color_map, &material.alpha_map}) {
    if (*map) width = std::max(width, map->image->width()), height = std::max(height, map->image->height());
  }
  const vec2 size(width, height);
  std::vector<vec4> texels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      int inside = 0;
      for (int i = 0; i < kSide * kSide; ++i) {
        const vec2 offset = (vec2(i % kSide, i / kSide) + 0.5f) / static_cast<float>(kSide);
        inside += alpha_at(material, (vec2(x, y) + offset) / size) >= material.alpha_cutoff;
      }
      const float alpha = alpha_at(material, (vec2(x, y) + 0.5f) / size) / std::max(material.alpha, 1e-6f);
      texels.emplace_back(alpha, static_cast<float>(inside) / (kSide * kSide), 0, 1);
    }
  }
  return Texture(width, height, texels);
}

/// Makes `file` a link to `known`, if that still has these bytes. A copy does as well, so nothing is said if it cannot.
void link_to(const fs::path& known, const fs::path& file, uint64_t hash) {
  fs::path link = file;
  link += ".link";
  std::error_code error;
  fs::create_hard_link(known, link, error);
  if (error) return;
  const auto now = hash_file(link);
  if (now && *now == hash) fs::rename(link, file, error);
  fs::remove(link, error);
}

/// Writes textures, each once.
class TextureWriter {
 public:
  TextureWriter(const TextureModule& module, fs::path folder, const TextureFiles& known, AssetLook& look)
      : module_(module), folder_(std::move(folder)), known_(known), look_(look) {}

  Result<TextureRef> write_map(const SourceTexture& map, MapUse use) {
    if (!map) return TextureRef{};
    const auto [found, is_new] = written_.try_emplace({map.image.get(), use}, next());
    if (is_new) FARFIELD_TRY(write(*map.image, use));
    return TextureRef{found->second, map.wrap_u, map.wrap_v};
  }

  Result<TextureRef> write_mask(const SourceMaterial& m) {
    if (!m.base_color_map && !m.alpha_map) return TextureRef{};
    const SourceTexture& wraps = m.base_color_map ? m.base_color_map : m.alpha_map;
    const auto [found, is_new] =
        masks_.try_emplace({m.base_color_map.image.get(), m.alpha_map.image.get(), m.alpha, m.alpha_cutoff}, next());
    if (is_new) FARFIELD_TRY(write(make_mask(m), MapUse::Mask));
    return TextureRef{found->second, wraps.wrap_u, wraps.wrap_v};
  }

 private:
  Index next() const { return static_cast<Index>(look_.textures.size()); }

  Result<void> write(const Texture& image, MapUse use) {
    const size_t first = use == MapUse::Alpha ? 3 : 0;
    const size_t count = use == MapUse::Alpha ? 1 : use == MapUse::Mask ? 2 : has_alpha(image) ? 4 : 3;
    const std::vector<MipLevel> levels = channels_of(image, first, count);
    const bool as_bytes = is_of_bytes(levels[0]);
    AssetTexture texture;
    texture.file = fmt::format("texture_{}.tif", next());
    texture.width = static_cast<uint32_t>(image.width());
    texture.height = static_cast<uint32_t>(image.height());
    texture.channels = static_cast<uint32_t>(count);
    for (const MipLevel& level : levels) {
      texture.cache_bytes += tiled_bytes(level.width, level.height, count * (as_bytes ? 1 : 2));
    }
    const fs::path path = folder_ / texture.file;
    FARFIELD_TRY(module_.write_mip_map(path.string(), levels, static_cast<int>(count), as_bytes));
    FARFIELD_TRY(sync_file(path));
    FARFIELD_TRY_LET(texture.file_hash, hash_file(path));
    texture.file_bytes = fs::file_size(path);
    if (const auto known = known_.find(texture.file_hash); known != known_.end())
      link_to(known->second, path, texture.file_hash);
    look_.textures.push_back(std::move(texture));
    return {};
  }

  const TextureModule& module_;
  const fs::path folder_;
  const TextureFiles& known_;
  AssetLook& look_;
  std::map<std::pair<const Texture*, MapUse>, Index> written_;
  std::map<std::tuple<const Texture*, const Texture*, float, float>, Index> masks_;
};

Result<void> write_maps(const SourceMaterial& from, TextureWriter& writer, AssetMaterial& to) {
  FARFIELD_TRY_LET(to.base_color_map, writer.write_map(from.base_color_map, MapUse::Color));
  FARFIELD_TRY_LET(to.metallic_roughness_map, writer.write_map(from.metallic_roughness_map, MapUse::Color));
  FARFIELD_TRY_LET(to.normal_map, writer.write_map(from.normal_map, MapUse::Color));
  FARFIELD_TRY_LET(to.emission_map, writer.write_map(from.emission_map, MapUse::Color));
  if (from.alpha_mode == AlphaMode::Blend) {
    FARFIELD_TRY_LET(to.alpha_map, writer.write_map(from.alpha_map, MapUse::Alpha));
  }
  if (from.alpha_mode == AlphaMode::Mask) {
    FARFIELD_TRY_LET(to.mask_map, writer.write_mask(from));
  }
  return {};
}

}  // namespace

Result<AssetLook> write_textures(const SourceSurface& source, const fs::path& folder, const TextureFiles& known,
                                 const Job& job) {
  AssetLook look;
  for (const SourceMaterial& material : source.materials) {
    static_cast<MaterialFactors&>(look.materials.emplace_back()) = material;
  }
  const bool has_maps =
      !source.material_function && !source.corner_uv.empty() && std::ranges::any_of(source.materials, has_textures);
  if (!has_maps) return look;
  FARFIELD_TRY_LET(const TextureModule* module, texture_module());
  TextureWriter writer(*module, folder, known, look);
  for (size_t m = 0; m < look.materials.size(); ++m) {
    if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "bake: cancelled");
    FARFIELD_TRY(write_maps(source.materials[m], writer, look.materials[m]));
  }
  return look;
}

std::vector<double> texel_areas(const SourceSurface& source, const AssetLook& look) {
  std::vector<double> area(look.materials.size()), uv_area(look.materials.size());
  for (size_t t = 0; t < source.triangles.size(); ++t) {
    const UvTriangle uv = source.uv_of(t);
    if (!is_usable(uv)) continue;
    const vec2 a = uv[1] - uv[0], b = uv[2] - uv[0];
    area[source.material[t]] += 0.5 * glm::length(source.area_vector(t));
    uv_area[source.material[t]] += 0.5 * std::abs(static_cast<double>(a.x * b.y - a.y * b.x));
  }
  std::vector<double> texel(look.textures.size(), 0);
  for (size_t m = 0; m < look.materials.size(); ++m) {
    if (!(uv_area[m] > 0)) continue;
    const AssetMaterial& material = look.materials[m];
    const auto note = [&](const TextureRef& map) {
      if (!map) return;
      const AssetTexture& t = look.textures[map.texture];
      texel[map.texture] = std::max(texel[map.texture], area[m] / uv_area[m] / (double(t.width) * t.height));
    };
    for (const TextureRef* map : material.maps()) note(*map);
    note(material.mask_map);
  }
  return texel;
}

uint64_t texture_bytes_at(const std::vector<double>& texel_areas, const AssetLook& look, double resolution) {
  double bytes = 0;
  for (size_t t = 0; t < texel_areas.size(); ++t) {
    const double texel = texel_areas[t];
    const double coarser = texel > 0 ? std::max(1.0, resolution * resolution / texel) : 1.0;
    bytes += static_cast<double>(look.textures[t].cache_bytes) / coarser;
  }
  return static_cast<uint64_t>(bytes);
}

}  // namespace farfield
