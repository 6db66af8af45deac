// SPDX-License-Identifier: Apache-2.0
// Decoding through OpenImageIO: the only file of this room that sees its headers.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "import/texture.h"

namespace farfield {
namespace {

constexpr int64_t kMaxTexels = int64_t{1} << 27;  // 11.5k squared: 1 GiB once in memory, 1.3 with its smaller levels

/// What the file is, from its first bytes: embedded images have no name to tell.
std::string extension_of(std::span<const unsigned char> bytes) {
  const auto starts_with = [&](std::initializer_list<unsigned char> magic) {
    return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
  };
  if (starts_with({0x89, 'P', 'N', 'G'})) return ".png";
  if (starts_with({0xff, 0xd8})) return ".jpg";
  if (starts_with({0x76, 0x2f, 0x31, 0x01})) return ".exr";
  if (starts_with({'R', 'I', 'F', 'F'})) return ".webp";
  return "";
}

/// Turns the decoded channels into straight linear RGBA, as `use` wants it.
std::vector<vec4> to_texels(const std::vector<float>& values, int channels, int alpha_channel, bool is_srgb,
                            TextureUse use) {
  std::vector<vec4> texels(values.size() / static_cast<size_t>(channels));
  const bool is_grey = channels - (alpha_channel >= 0 ? 1 : 0) < 3;
  for (size_t i = 0; i < texels.size(); ++i) {
    const float* v = values.data() + i * static_cast<size_t>(channels);
    vec4 t = is_grey ? vec4(v[0], v[0], v[0], 1) : vec4(v[0], v[1], v[2], 1);
    if (is_srgb && use != TextureUse::Data) {
      for (int c = 0; c < 3; ++c) t[c] = srgb_to_linear(std::clamp(t[c], 0.0f, 1.0f));
    }
    if (use == TextureUse::Mask) {
      t.w = alpha_channel >= 0 ? v[alpha_channel] : v[0];
    } else if (use == TextureUse::ColorWithAlpha && alpha_channel >= 0) {
      t.w = v[alpha_channel];
    }
    texels[i] = t;
  }
  return texels;
}

Result<Texture> read_input(OIIO::ImageInput& input, const std::string& name, TextureUse use) {
  const OIIO::ImageSpec spec = input.spec();
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: not a two-dimensional image", name));
  }
  if (int64_t{spec.width} * spec.height > kMaxTexels || spec.nchannels > 64) {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: {} x {} texels with {} channels are too many; scale it down", name, spec.width,
                                  spec.height, spec.nchannels));
  }
  const int channels = std::min(spec.nchannels, 4);
  std::vector<float> values(static_cast<size_t>(spec.width) * static_cast<size_t>(spec.height) *
                            static_cast<size_t>(channels));
  if (!input.read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, values.data())) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: {}", name, input.geterror()));
  }
  const int alpha = spec.alpha_channel >= 0 && spec.alpha_channel < channels ? spec.alpha_channel : -1;
  const bool is_srgb = !spec.format.is_floating_point();
  return Texture(spec.width, spec.height, to_texels(values, channels, alpha, is_srgb, use));
}

}  // namespace

Result<Texture> decode_texture(std::span<const unsigned char> bytes, const std::string& name, TextureUse use) {
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;  // keep the colour under transparent texels as stored
  OIIO::Filesystem::IOMemReader reader(bytes.data(), bytes.size());
  const std::string extension = extension_of(bytes);
  if (extension.empty()) {
    return make_error(ErrorCode::Unsupported, fmt::format("{}: not a PNG, JPEG, WebP or EXR image", name));
  }
  OIIO::Filesystem::IOProxy* proxy = &reader;
  config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  const auto input = OIIO::ImageInput::open("image" + extension, &config, proxy);
  if (!input) return make_error(ErrorCode::BadFile, fmt::format("{}: {}", name, OIIO::geterror()));
  return read_input(*input, name, use);
}

Result<Texture> read_texture(const std::filesystem::path& path, TextureUse use) {
  const std::string name = path.string();
  if (!std::filesystem::is_regular_file(path)) {
    return make_error(ErrorCode::NotFound, fmt::format("{}: no such image file", name));
  }
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;
  const auto input = OIIO::ImageInput::open(name, &config);
  if (!input) return make_error(ErrorCode::BadFile, fmt::format("{}: {}", name, OIIO::geterror()));
  return read_input(*input, name, use);
}

}  // namespace farfield
