// SPDX-License-Identifier: Apache-2.0
// The module farfield_textures: decoding through OpenImageIO, which only the files of this module see.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "base/texture_module.h"
#include "farfield/export.h"
#include "import/texture_oiio.h"

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

Result<DecodedImage> read_input(OIIO::ImageInput& input, const std::string& name) {
  const OIIO::ImageSpec spec = input.spec();
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: not a two-dimensional image", name));
  }
  if (int64_t{spec.width} * spec.height > kMaxTexels || spec.nchannels > 64) {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: {} x {} texels with {} channels are too many; scale it down", name, spec.width,
                                  spec.height, spec.nchannels));
  }
  DecodedImage image;
  image.width = spec.width;
  image.height = spec.height;
  image.channels = std::min(spec.nchannels, 4);
  image.alpha_channel = spec.alpha_channel >= 0 && spec.alpha_channel < image.channels ? spec.alpha_channel : -1;
  image.is_float = spec.format.is_floating_point();
  image.values.resize(static_cast<size_t>(image.width) * static_cast<size_t>(image.height) *
                      static_cast<size_t>(image.channels));
  if (!input.read_image(0, 0, 0, image.channels, OIIO::TypeDesc::FLOAT, image.values.data())) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: {}", name, input.geterror()));
  }
  return image;
}

Result<DecodedImage> decode(std::span<const unsigned char> bytes, const std::string& name) {
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
  return read_input(*input, name);
}

Result<DecodedImage> read_file(const std::string& name) {
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;
  const auto input = OIIO::ImageInput::open(name, &config);
  if (!input) return make_error(ErrorCode::BadFile, fmt::format("{}: {}", name, OIIO::geterror()));
  return read_input(*input, name);
}

}  // namespace
}  // namespace farfield

extern "C" FARFIELD_API const farfield::TextureModule farfield_texture_module_2;
const farfield::TextureModule farfield_texture_module_2 = {farfield::read_file, farfield::decode,
                                                           farfield::write_mip_map, farfield::make_texture_lookup};
