// SPDX-License-Identifier: Apache-2.0
// Textures in memory: linear RGBA with all their half-size averages.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/vec.h"
#include "import/height_map.h"

namespace farfield {

enum class TextureUse {
  Color,           ///< sRGB unless the file stores floats; alpha is ignored and reads as 1
  ColorWithAlpha,  ///< the same, with alpha
  Data,            ///< stored values as they are
  Mask,            ///< alpha is the file's alpha channel, or its first channel when it has none
};

/// Immutable once made. RGB is stored multiplied with alpha, so averages of texels weight colour by coverage.
class Texture {
 public:
  /// One size of the image; level 0 is the file's, each further one half of it, down to one texel.
  struct Level {
    int width = 0, height = 0;
    std::vector<std::array<uint16_t, 4>> texels;  ///< row by row from the top, 65535 = 1
  };

  /// texels: width * height values in [0, 1], straight (not multiplied) alpha, row by row from the top. Both sides
  /// >= 1.
  Texture(int width, int height, std::span<const vec4> texels);

  const Level& level(int index) const { return levels_[static_cast<size_t>(index)]; }
  int level_count() const { return static_cast<int>(levels_.size()); }
  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }
  /// Premultiplied RGBA of one texel of a level; the caller wraps the coordinates.
  vec4 texel(const Level& level, int x, int y) const {
    const auto& t = level.texels[static_cast<size_t>(y) * static_cast<size_t>(level.width) + static_cast<size_t>(x)];
    return vec4(t[0], t[1], t[2], t[3]) * (1.0f / 65535.0f);
  }
  /// Premultiplied mean of all texels.
  vec4 mean() const { return texel(levels_.back(), 0, 0); }

 private:
  std::vector<Level> levels_;
};

/// Reads an image file in any format that OpenImageIO knows. Errors: NotFound, BadFile, Unsupported (too large); Io
/// when no image at all can be read, because the module that decodes them is missing (texture_module.h).
Result<Texture> read_texture(const std::filesystem::path& path, TextureUse use);

/// Reads an image file that lies in memory: PNG, JPEG, WebP or EXR. `name` is for messages. Errors: BadFile,
/// Unsupported; Io as read_texture.
Result<Texture> decode_texture(std::span<const unsigned char> bytes, const std::string& name, TextureUse use);

/// The heights in a channel of an image file, as they are stored. channel: r, g, b, m (alpha; the first where there is
/// none) or l (mean of r, g, b); anything else is r. Errors: those of read_texture and decode_texture.
Result<HeightMap> read_heights(const std::filesystem::path& path, char channel);
Result<HeightMap> decode_heights(std::span<const unsigned char> bytes, const std::string& name, char channel);

/// A line that says what values of the map `name` were mended; empty if none were.
std::string what_was_mended(const HeightMap& map, const std::string& name);

/// The sRGB transfer function, [0, 1] to linear [0, 1].
float srgb_to_linear(float value);

}  // namespace farfield
