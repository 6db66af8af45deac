// SPDX-License-Identifier: Apache-2.0
// Tiled, MIP-mapped textures, as OpenImageIO's texture system wants them.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <vector>

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
  spec.attribute("DateTime", "1970:01:01 00:00:00");  // else the present, and files of the same bake differ
  return spec;
}

/// The tile at (x, y), what lies beyond the image being 0: OpenImageIO itself leaves chance bytes there.
void copy_tile(const MipLevel& level, int channels, int x, int y, std::vector<uint16_t>& tile) {
  std::fill(tile.begin(), tile.end(), uint16_t{0});
  const auto row_values = static_cast<size_t>(std::min(kTileSide, level.width - x) * channels);
  for (int row = 0; row < std::min(kTileSide, level.height - y); ++row) {
    const auto from = (static_cast<size_t>(y + row) * static_cast<size_t>(level.width) + static_cast<size_t>(x)) *
                      static_cast<size_t>(channels);
    std::copy_n(level.values.begin() + static_cast<ptrdiff_t>(from), row_values,
                tile.begin() + static_cast<ptrdiff_t>(row) * kTileSide * channels);
  }
}

bool write_tiles(OIIO::ImageOutput& out, const MipLevel& level, int channels) {
  std::vector<uint16_t> tile(static_cast<size_t>(kTileSide * kTileSide * channels));
  for (int y = 0; y < level.height; y += kTileSide) {
    for (int x = 0; x < level.width; x += kTileSide) {
      copy_tile(level, channels, x, y, tile);
      if (!out.write_tile(x, y, 0, OIIO::TypeDesc::UINT16, tile.data())) return false;
    }
  }
  return true;
}

}  // namespace

Result<void> write_mip_map(const std::string& path, std::span<const MipLevel> levels, int channels, bool as_bytes) {
  const auto out = OIIO::ImageOutput::create("tiff");
  if (!out) return cannot_write(path, OIIO::geterror());
  auto mode = OIIO::ImageOutput::Create;
  for (const MipLevel& level : levels) {
    if (!out->open(path, spec_of(level, channels, as_bytes), mode)) return cannot_write(path, out->geterror());
    if (!write_tiles(*out, level, channels)) return cannot_write(path, out->geterror());
    mode = OIIO::ImageOutput::AppendSubimage;  // so TIFF keeps sizes; "textureformat" says what they are
  }
  if (!out->close()) return cannot_write(path, out->geterror());
  return {};
}

}  // namespace farfield
