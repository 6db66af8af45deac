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
  if (!std::isfinite(m.normal_scale)) return fmt::format("normal_scale is {}", m.normal_scale);
  return {};
}

/// Images by file and use, and the name of the material at hand.
class MaterialReader {
 public:
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

 private:
  tl::unexpected<Error> error(const std::string& what) const {
    return make_error(ErrorCode::InvalidArgument, name_ + ": " + what);
  }

  Result<SourceTexture> texture(const BakeTexture& in, TextureUse use, const char* field) {
    SourceTexture out{nullptr, to_wrap(in.wrap_u), to_wrap(in.wrap_v)};
    if (!in) return out;
    if (!in.file.empty() && !in.pixels.empty()) {
      return error(fmt::format("{} has a file and pixels; one of them", field));
    }
    FARFIELD_TRY_LET(out.image, in.pixels.empty() ? from_file(in.file, use, field) : from_pixels(in, use, field));
    return out;
  }

  using Image = std::shared_ptr<const Texture>;

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
    const bool has_size = in.width >= 1 && in.height >= 1 && in.width <= kLongestSide && in.height <= kLongestSide;
    if (!has_size || in.pixels.size() != static_cast<size_t>(in.width) * static_cast<size_t>(in.height)) {
      return error(fmt::format("{} has {} pixels for {} x {}, each side in 1 to {}", field, in.pixels.size(), in.width,
                               in.height, kLongestSide));
    }
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

  std::string name_;
  std::map<std::pair<std::string, TextureUse>, Image> images_;
};

}  // namespace

Result<std::vector<SourceMaterial>> gather_materials(const BakeInput& input, size_t count) {
  std::vector<SourceMaterial> out;
  MaterialReader reader;
  for (size_t i = 0; i < input.materials.size(); ++i) {
    FARFIELD_TRY_LET(auto material, reader.read(input.materials[i], i));
    out.push_back(std::move(material));
  }
  if (out.size() < count) out.resize(count);
  return out;
}

}  // namespace farfield
