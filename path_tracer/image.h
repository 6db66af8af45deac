// SPDX-License-Identifier: Apache-2.0
// Float images in memory and in files: OpenEXR with any channels and metadata, PNG previews, contact sheets.
#pragma once

#include <array>
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

/// Indices of R, G and B, -1 where missing; an image without any of them is grey: its first channel three times.
std::array<int, 3> rgb_channels(const Image& image);

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

struct PngOptions {
  float exposure_stops = 0;  ///< RGB is multiplied by 2^exposure_stops
};
/// Writes R, G, B (or the one channel, as grey) as 8-bit sRGB [IEC 1999], clipped to [0, 1], NaN as 0, without
/// alpha, to a temporary name that is then renamed. Errors: Io, InvalidArgument (empty image).
Result<void> write_png(const std::filesystem::path& path, const Image& image, const PngOptions& options = {});

/// The named channels alone, in this order; those that the image lacks are 0.
Image select_channels(const Image& image, const std::vector<std::string>& names);

/// The image at 1/n of its size by averaging n x n pixels; blocks at the right and lower edge may be partial. n >= 1.
Image downsample(const Image& image, int n);

/// Pictures in rows on one black sheet. All memory is allocated and touched by the constructor.
class ContactSheet {
 public:
  /// Cells of cell_width x cell_height pixels in rows of `columns`, `gap` pixels apart. All >= 1, gap >= 0.
  ContactSheet(int count, int columns, int cell_width, int cell_height, int gap = 2);

  /// Puts R, G, B of an image into a cell (row by row), averaged down by the smallest whole factor that makes it fit.
  void set(int cell, const Image& image);
  const Image& image() const { return sheet_; }

 private:
  int columns_, cell_width_, cell_height_, gap_;
  Image sheet_;
};

}  // namespace farfield
