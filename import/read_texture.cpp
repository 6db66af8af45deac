// SPDX-License-Identifier: Apache-2.0
// From decoded channels to textures; the decoding itself lies in the module.
#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "base/texture_module.h"
#include "import/texture.h"

namespace farfield {
namespace {

/// Turns the decoded channels into straight linear RGBA, as `use` wants it.
std::vector<vec4> to_texels(const DecodedImage& image, TextureUse use) {
  const auto channels = static_cast<size_t>(image.channels);
  const int alpha = image.alpha_channel;
  const bool is_srgb = !image.is_float && use != TextureUse::Data;
  const bool is_grey = image.channels - (alpha >= 0 ? 1 : 0) < 3;
  std::vector<vec4> texels(image.values.size() / channels);
  for (size_t i = 0; i < texels.size(); ++i) {
    const float* v = image.values.data() + i * channels;
    vec4 t = is_grey ? vec4(v[0], v[0], v[0], 1) : vec4(v[0], v[1], v[2], 1);
    if (is_srgb) {
      for (int c = 0; c < 3; ++c) t[c] = srgb_to_linear(std::clamp(t[c], 0.0f, 1.0f));
    }
    if (use == TextureUse::Mask) {
      t.w = alpha >= 0 ? v[alpha] : v[0];
    } else if (use == TextureUse::ColorWithAlpha && alpha >= 0) {
      t.w = v[alpha];
    }
    texels[i] = t;
  }
  return texels;
}

Result<Texture> to_texture(const Result<DecodedImage>& image, TextureUse use) {
  if (!image) return tl::unexpected(image.error());
  return Texture(image->width, image->height, to_texels(*image, use));
}

float pick(const float* values, const DecodedImage& image, char channel) {
  const bool is_grey = image.channels - (image.alpha_channel >= 0 ? 1 : 0) < 3;
  if (channel == 'm' && image.alpha_channel >= 0) return values[image.alpha_channel];
  if (is_grey) return values[0];
  if (channel == 'l') return (values[0] + values[1] + values[2]) / 3;
  return values[channel == 'g' ? 1 : channel == 'b' ? 2 : 0];
}

Result<HeightMap> to_heights(const Result<DecodedImage>& image, char channel) {
  if (!image) return tl::unexpected(image.error());
  const auto channels = static_cast<size_t>(image->channels);
  std::vector<float> values(image->values.size() / channels);
  for (size_t i = 0; i < values.size(); ++i) values[i] = pick(image->values.data() + i * channels, *image, channel);
  return HeightMap(image->width, image->height, std::move(values));
}

tl::unexpected<Error> no_module(const std::string& name, const Error& error) {
  return make_error(error.code, fmt::format("{}: {}", name, error.message));
}

Result<DecodedImage> decode_image(std::span<const unsigned char> bytes, const std::string& name) {
  const auto module = texture_module();
  if (!module) return no_module(name, module.error());
  return (*module)->decode(bytes, name);
}

Result<DecodedImage> read_image(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return make_error(ErrorCode::NotFound, fmt::format("{}: no such image file", name));
  }
  const auto module = texture_module();
  if (!module) return no_module(name, module.error());
  return (*module)->read_file(name);
}

}  // namespace

Result<Texture> decode_texture(std::span<const unsigned char> bytes, const std::string& name, TextureUse use) {
  return to_texture(decode_image(bytes, name), use);
}

Result<Texture> read_texture(const std::filesystem::path& path, TextureUse use) {
  return to_texture(read_image(path), use);
}

Result<HeightMap> decode_heights(std::span<const unsigned char> bytes, const std::string& name, char channel) {
  return to_heights(decode_image(bytes, name), channel);
}

Result<HeightMap> read_heights(const std::filesystem::path& path, char channel) {
  return to_heights(read_image(path), channel);
}

std::string what_was_mended(const HeightMap& map, const std::string& name) {
  if (map.mended_count() == 0) return {};
  const size_t width = static_cast<size_t>(map.width());
  return fmt::format(
      "texture {}: {} of {} heights are not finite, the first at column {}, row {}; they take the mean "
      "of those around them",
      name, map.mended_count(), map.values().size(), map.first_mended() % width, map.first_mended() / width);
}

}  // namespace farfield
