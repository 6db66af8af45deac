// SPDX-License-Identifier: Apache-2.0
// Float images in memory and in files: OpenEXR with any channels and metadata, PNG previews, contact sheets.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "base/result.h"
#include "base/vec.h"

namespace farfield {

/// Channels side by side per pixel (interleaved), rows from top to bottom.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;  ///< names as in EXR files: "R", "G", "B", "A", "lod.level"
  std::vector<float> values;          ///< width * height * channels.size()

  Image() = default;
  Image(int image_width, int image_height, std::vector<std::string> channel_names);

  size_t channel_count() const { return channels.size(); }
  float* pixel(int x, int y) { return &values[(size_t(y) * size_t(width) + size_t(x)) * channels.size()]; }
  const float* pixel(int x, int y) const { return &values[(size_t(y) * size_t(width) + size_t(x)) * channels.size()]; }
  /// Index of a channel, -1 if there is none of that name.
  int find_channel(const std::string& name) const;
};

using MetadataValue = std::variant<int, float, vec3, std::string>;
/// Named values in a file's header, next to what the format itself puts there.
using Metadata = std::map<std::string, MetadataValue>;

/// Writes all channels as 32-bit floats, losslessly compressed, to a temporary name that is then renamed. The bytes
/// depend only on the arguments. Errors: Io, InvalidArgument (empty image).
Result<void> write_exr(const std::filesystem::path& path, const Image& image, const Metadata& metadata = {});

struct ExrFile {
  Image image;        ///< channels R, G, B, A first, in this order, then the rest by name
  Metadata metadata;  ///< int, float, vec3 and string attributes that are not the format's own
};
/// Reads a scanline or tiled, single-part EXR file. Errors: NotFound, BadFile, Unsupported (deep data).
Result<ExrFile> read_exr(const std::filesystem::path& path);

/// Linear RGB to 8-bit sRGB: scaled by 2^exposure_stops, then clipped [IEC 61966-2-1]. Alpha is kept when there is one.
struct PngOptions {
  float exposure_stops = 0;
};
/// Writes the first three channels (or one, as grey), and A if there is one, to a temporary name that is then renamed.
/// Errors: Io, InvalidArgument.
Result<void> write_png(const std::filesystem::path& path, const Image& image, const PngOptions& options = {});

/// Lays images out in rows of `columns`, row by row, `gap` pixels apart on black; cells are as large as the largest.
/// Missing channels are black, alpha is composited over mid-grey. The result has R, G, B.
Image contact_sheet(std::span<const Image> images, int columns, int gap = 2);

/// The image at 1/n of its size by averaging n x n pixels (the last row and column of blocks may be partial). n >= 1.
Image downsample(const Image& image, int n);

}  // namespace farfield
