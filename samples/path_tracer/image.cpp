// SPDX-License-Identifier: Apache-2.0
#include "samples/path_tracer/image.h"

#include <algorithm>

#include "base/check.h"

namespace farfield {

Image::Image(int image_width, int image_height, std::vector<std::string> channel_names)
    : width(image_width), height(image_height), channels(std::move(channel_names)) {
  FARFIELD_CHECK(width >= 0 && height >= 0);
  values.resize(static_cast<size_t>(width) * static_cast<size_t>(height) * channels.size(), 0.0f);
}

int Image::find_channel(const std::string& name) const {
  const auto found = std::find(channels.begin(), channels.end(), name);
  return found == channels.end() ? -1 : static_cast<int>(found - channels.begin());
}

}  // namespace farfield
