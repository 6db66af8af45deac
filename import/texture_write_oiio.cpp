// SPDX-License-Identifier: Apache-2.0
// Tiled, MIP-mapped textures, as OpenImageIO's texture system wants them.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include "base/result.h"
#include "import/texture_oiio.h"

namespace farfield {
namespace {

constexpr int kTileSide = 64;

tl::unexpected<Error> cannot_write(const std::string& path, const std::string& why) {
  return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}", path, why));
}

OIIO::ImageSpec spec_of(const MipLevel& level, int channels, bool as_bytes) {
  OIIO::ImageSpec spec(level.width, level.height, channels, as_bytes ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16);
  spec.tile_width = spec.tile_height = kTileSide;
  spec.tile_depth = 1;
  spec.alpha_channel = channels == 4 ? 3 : -1;
  spec.attribute("compression", "zip");
  spec.attribute("textureformat", "Plain Texture");
  spec.attribute("oiio:ColorSpace", "Linear");
  return spec;
}

}  // namespace

Result<void> write_mip_map(const std::string& path, std::span<const MipLevel> levels, int channels, bool as_bytes) {
  const auto out = OIIO::ImageOutput::create("tiff");
  if (!out) return cannot_write(path, OIIO::geterror());
  auto mode = OIIO::ImageOutput::Create;
  for (const MipLevel& level : levels) {
    if (!out->open(path, spec_of(level, channels, as_bytes), mode)) return cannot_write(path, out->geterror());
    if (!out->write_image(OIIO::TypeDesc::UINT16, level.values.data())) return cannot_write(path, out->geterror());
    mode = OIIO::ImageOutput::AppendSubimage;  // so TIFF keeps sizes; "textureformat" says what they are
  }
  if (!out->close()) return cannot_write(path, out->geterror());
  return {};
}

}  // namespace farfield
