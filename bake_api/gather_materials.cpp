// SPDX-License-Identifier: Apache-2.0
#include "bake_api/gather_materials.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>
#include <utility>

namespace farfield {
namespace {

constexpr int kLongestSide = 1 << 15;

Wrap to_wrap(BakeTexture::Wrap wrap) {
  switch (wrap) {
    case BakeTexture::Wrap::Clamp:
      return Wrap::Clamp;
    case BakeTexture::Wrap::Mirror:
      return Wrap::Mirror;
    case BakeTexture::Wrap::Repeat:
      break;
  }
  return Wrap::Repeat;
}

AlphaMode to_alpha_mode(BakeMaterial::Alpha alpha) {
  switch (alpha) {
    case BakeMaterial::Alpha::Mask:
      return AlphaMode::Mask;
    case BakeMaterial::Alpha::Blend:
      return AlphaMode::Blend;
    case BakeMaterial::Alpha::Opaque:
      break;
  }
  return AlphaMode::Opaque;
}

bool is_unit(float value) { return value >= 0 && value <= 1; }
bool is_unit(const vec3& value) { return is_unit(value.x) && is_unit(value.y) && is_unit(value.z); }

/// The field of a material that is out of its range; empty if none is.
std::string find_bad_field(const BakeMaterial& m) {
  for (const auto& [name, value] : {std::pair("base_color", m.base_color), std::pair("specular_f0", m.specular_f0),
                                    std::pair("diffuse_transmission_color", m.diffuse_transmission_color)}) {
    if (!is_unit(value)) return fmt::format("{} is ({}, {}, {}), not in [0, 1]", name, value.x, value.y, value.z);
  }
  for (const auto& [name, value] :
       {std::pair("alpha", m.alpha), std::pair("alpha_cutoff", m.alpha_cutoff), std::pair("metallic", m.metallic),
        std::pair("roughness", m.roughness), std::pair("diffuse_transmission", m.diffuse_transmission),
        std::pair("thin_transmission", m.thin_transmission)}) {
    if (!is_unit(value)) return fmt::format("{} is {}, not in [0, 1]", name, value);
  }
  if (!is_finite(m.emission) || min_component(m.emission) < 0) {
    return fmt::format("emission is ({}, {}, {}), not finite and >= 0", m.emission.x, m.emission.y, m.emission.z);
  }
  for (const auto& [name, value] : {std::pair("normal_scale", m.normal_scale), std::pair("height_gain", m.height_gain),
                                    std::pair("height_base", m.height_base)}) {
    if (!std::isfinite(value)) return fmt::format("{} is {}", name, value);
  }
  return {};
}

/// Images by file and use, and the name of the material at hand.
class MaterialReader {
 public:
  explicit MaterialReader(std::vector<std::string>& warnings) : warnings_(warnings) {}

  Result<SourceMaterial> read(const BakeMaterial& in, size_t index) {
    name_ = in.name.empty() ? fmt::format("material {}", index) : fmt::format("material {} ({})", index, in.name);
    if (const std::string bad = find_bad_field(in); !bad.empty()) return error(bad);
    const auto color_use =
        in.alpha_mode == BakeMaterial::Alpha::Opaque ? TextureUse::Color : TextureUse::ColorWithAlpha;
    SourceMaterial out;
    out.name = in.name;
    out.base_color = in.base_color;
    out.alpha = in.alpha;
    out.metallic = in.metallic;
    out.roughness = in.roughness;
    out.dielectric_f0 = in.specular_f0;
    out.diffuse_transmission = in.diffuse_transmission;
    out.diffuse_transmission_color = in.diffuse_transmission_color;
    out.alpha_mode = to_alpha_mode(in.alpha_mode);
    out.alpha_cutoff = in.alpha_cutoff;
    out.normal_scale = in.normal_scale;
    out.emission = in.emission;
    out.thin_transmission = in.thin_transmission;
    FARFIELD_TRY_LET(out.base_color_map, texture(in.base_color_texture, color_use, "base_color_texture"));
    FARFIELD_TRY_LET(out.metallic_roughness_map, texture(in.roughness_texture, TextureUse::Data, "roughness_texture"));
    FARFIELD_TRY_LET(out.alpha_map, texture(in.alpha_texture, TextureUse::Mask, "alpha_texture"));
    FARFIELD_TRY_LET(out.normal_map, texture(in.normal_texture, TextureUse::Data, "normal_texture"));
    FARFIELD_TRY_LET(out.emission_map, texture(in.emission_texture, TextureUse::Color, "emission_texture"));
    return out;
  }

  /// Of the material that was read last.
  Result<SourceHeights> read_heights(const BakeMaterial& in) {
    const BakeTexture& texture = in.height_texture;
    SourceHeights out;
    if (!texture) return out;
    FARFIELD_TRY(check_source(texture, "height_texture"));
    FARFIELD_TRY_LET(out.map, texture.pixels.empty() ? heights_from_file(texture.file) : heights_from_pixels(texture));
    out.name = texture.file.empty() ? "height_texture" : texture.file;
    out.wrap_u = to_wrap(texture.wrap_u);
    out.wrap_v = to_wrap(texture.wrap_v);
    out.gain = in.height_gain;
    out.base = in.height_base;
    return out;
  }

 private:
  tl::unexpected<Error> error(const std::string& what) const {
    return make_error(ErrorCode::InvalidArgument, name_ + ": " + what);
  }

  Result<SourceTexture> texture(const BakeTexture& in, TextureUse use, const char* field) {
    SourceTexture out{nullptr, to_wrap(in.wrap_u), to_wrap(in.wrap_v)};
    if (!in) return out;
    FARFIELD_TRY(check_source(in, field));
    FARFIELD_TRY_LET(out.image, in.pixels.empty() ? from_file(in.file, use, field) : from_pixels(in, use, field));
    return out;
  }

  /// That there is one source, and of pixels as many as it says.
  Result<void> check_source(const BakeTexture& in, const char* field) const {
    if (!in.file.empty() && !in.pixels.empty()) {
      return error(fmt::format("{} has a file and pixels; one of them", field));
    }
    if (in.pixels.empty()) return {};
    const bool has_size = in.width >= 1 && in.height >= 1 && in.width <= kLongestSide && in.height <= kLongestSide;
    if (has_size && in.pixels.size() == static_cast<size_t>(in.width) * static_cast<size_t>(in.height)) return {};
    return error(fmt::format("{} has {} pixels for {} x {}, each side in 1 to {}", field, in.pixels.size(), in.width,
                             in.height, kLongestSide));
  }

  using Image = std::shared_ptr<const Texture>;
  using Heights = std::shared_ptr<const HeightMap>;

  Result<Image> from_file(const std::string& file, TextureUse use, const char* field) {
    Image& image = images_[{file, use}];
    if (image) return image;
    auto read = read_texture(file, use);
    if (!read) {
      return make_error(read.error().code, fmt::format("{}: {}: {}", name_, field, read.error().message));
    }
    image = std::make_shared<const Texture>(std::move(*read));
    return image;
  }

  Result<Image> from_pixels(const BakeTexture& in, TextureUse use, const char* field) const {
    const bool has_alpha = use == TextureUse::ColorWithAlpha || use == TextureUse::Mask;
    std::vector<vec4> texels(in.pixels.size());
    for (size_t i = 0; i < texels.size(); ++i) {
      for (int channel = 0; channel < 4; ++channel) texels[i][channel] = static_cast<float>(in.pixels.at(i, channel));
      if (!is_unit(vec3(texels[i])) || !is_unit(texels[i].w)) {
        return error(fmt::format("{}: pixel ({}, {}) is not in [0, 1]", field, i % static_cast<size_t>(in.width),
                                 i / static_cast<size_t>(in.width)));
      }
      if (!has_alpha) texels[i].w = 1;
    }
    return std::make_shared<const Texture>(in.width, in.height, texels);
  }

  Result<Heights> heights_from_file(const std::string& file) {
    Heights& heights = heights_[file];
    if (heights) return heights;
    auto read = farfield::read_heights(file, 'r');
    if (!read) {
      return make_error(read.error().code, fmt::format("{}: height_texture: {}", name_, read.error().message));
    }
    if (const std::string mended = what_was_mended(*read, file); !mended.empty()) warnings_.push_back(mended);
    heights = std::make_shared<const HeightMap>(std::move(*read));
    return heights;
  }

  Result<Heights> heights_from_pixels(const BakeTexture& in) const {
    std::vector<float> values(in.pixels.size());
    for (size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(in.pixels.at(i, 0));
      if (std::isfinite(values[i])) continue;
      return error(fmt::format("height_texture: pixel ({}, {}) is not finite", i % static_cast<size_t>(in.width),
                               i / static_cast<size_t>(in.width)));
    }
    return std::make_shared<const HeightMap>(in.width, in.height, std::move(values));
  }

  std::vector<std::string>& warnings_;
  std::string name_;
  std::map<std::pair<std::string, TextureUse>, Image> images_;
  std::map<std::string, Heights> heights_;
};

}  // namespace

Result<GatheredMaterials> gather_materials(const BakeInput& input, size_t count) {
  GatheredMaterials out;
  MaterialReader reader(out.warnings);
  for (size_t i = 0; i < input.materials.size(); ++i) {
    FARFIELD_TRY_LET(auto material, reader.read(input.materials[i], i));
    out.materials.push_back(std::move(material));
    FARFIELD_TRY_LET(auto heights, reader.read_heights(input.materials[i]));
    if (!heights) continue;
    out.heights.resize(input.materials.size());
    out.heights[i] = std::move(heights);
  }
  if (out.materials.size() < count) out.materials.resize(count);
  if (!out.heights.empty()) out.heights.resize(out.materials.size());
  return out;
}

}  // namespace farfield
