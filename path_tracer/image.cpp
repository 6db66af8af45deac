// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/image.h"

#include <algorithm>

#include "base/check.h"

namespace farfield {

namespace {

// Mean of a block of at most n x n pixels of one channel.
float block_mean(const Image& image, int x0, int y0, int n, size_t channel) {
  const int x1 = std::min(x0 + n, image.width), y1 = std::min(y0 + n, image.height);
  double sum = 0;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) sum += static_cast<double>(image.pixel(x, y)[channel]);
  return static_cast<float>(sum / (static_cast<double>(x1 - x0) * (y1 - y0)));
}

int divide_up(int a, int b) { return (a + b - 1) / b; }

}  // namespace

Image::Image(int image_width, int image_height, std::vector<std::string> channel_names)
    : width(image_width), height(image_height), channels(std::move(channel_names)) {
  FARFIELD_CHECK(width >= 0 && height >= 0);
  values.resize(static_cast<size_t>(width) * static_cast<size_t>(height) * channels.size(), 0.0f);
}

int Image::find_channel(const std::string& name) const {
  const auto found = std::find(channels.begin(), channels.end(), name);
  return found == channels.end() ? -1 : static_cast<int>(found - channels.begin());
}

std::array<int, 3> rgb_channels(const Image& image) {
  std::array<int, 3> rgb{image.find_channel("R"), image.find_channel("G"), image.find_channel("B")};
  if (rgb[0] < 0 && rgb[1] < 0 && rgb[2] < 0) rgb.fill(image.channels.empty() ? -1 : 0);
  return rgb;
}

Image select_channels(const Image& image, const std::vector<std::string>& names) {
  Image result(image.width, image.height, names);
  for (size_t c = 0; c < names.size(); ++c) {
    const int from = image.find_channel(names[c]);
    if (from < 0) continue;
    for (size_t i = 0; i * image.channel_count() < image.values.size(); ++i)
      result.values[i * names.size() + c] = image.values[i * image.channel_count() + static_cast<size_t>(from)];
  }
  return result;
}

Image downsample(const Image& image, int n) {
  FARFIELD_CHECK(n >= 1);
  Image small(divide_up(image.width, n), divide_up(image.height, n), image.channels);
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x)
      for (size_t c = 0; c < image.channel_count(); ++c) small.pixel(x, y)[c] = block_mean(image, x * n, y * n, n, c);
  return small;
}

ContactSheet::ContactSheet(int count, int columns, int cell_width, int cell_height, int gap)
    : columns_(columns), cell_width_(cell_width), cell_height_(cell_height), gap_(gap) {
  FARFIELD_CHECK(count >= 1 && columns >= 1 && cell_width >= 1 && cell_height >= 1 && gap >= 0);
  const int used_columns = std::min(columns, count);
  const int rows = divide_up(count, columns);
  sheet_ = Image(used_columns * (cell_width + gap) - gap, rows * (cell_height + gap) - gap, {"R", "G", "B"});
}

void ContactSheet::set(int cell, const Image& image) {
  const int x0 = (cell % columns_) * (cell_width_ + gap_);
  const int y0 = (cell / columns_) * (cell_height_ + gap_);
  FARFIELD_CHECK(cell >= 0 && x0 + cell_width_ <= sheet_.width && y0 + cell_height_ <= sheet_.height);
  const int n = std::max({1, divide_up(image.width, cell_width_), divide_up(image.height, cell_height_)});
  const std::array<int, 3> rgb = rgb_channels(image);
  for (int y = 0; y < divide_up(image.height, n); ++y) {
    for (int x = 0; x < divide_up(image.width, n); ++x) {
      float* to = sheet_.pixel(x0 + x, y0 + y);
      for (int c = 0; c < 3; ++c)
        to[c] = rgb[c] < 0 ? 0.0f : block_mean(image, x * n, y * n, n, static_cast<size_t>(rgb[c]));
    }
  }
}

}  // namespace farfield
