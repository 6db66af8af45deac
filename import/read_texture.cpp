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

tl::unexpected<Error> no_module(const std::string& name, const Error& error) {
  return make_error(error.code, fmt::format("{}: {}", name, error.message));
}

}  // namespace

Result<Texture> decode_texture(std::span<const unsigned char> bytes, const std::string& name, TextureUse use) {
  const auto module = texture_module();
  if (!module) return no_module(name, module.error());
  return to_texture((*module)->decode(bytes, name), use);
}

Result<Texture> read_texture(const std::filesystem::path& path, TextureUse use) {
  const std::string name = path.string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return make_error(ErrorCode::NotFound, fmt::format("{}: no such image file", name));
  }
  const auto module = texture_module();
  if (!module) return no_module(name, module.error());
  return to_texture((*module)->read_file(name), use);
}

}  // namespace farfield
