// SPDX-License-Identifier: Apache-2.0
#include "import/derived_maps.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace farfield {
namespace {

float pick(const vec4& texel, char channel) {
  switch (channel) {
    case 'g':
      return texel.y;
    case 'b':
      return texel.z;
    case 'l':
      return (texel.x + texel.y + texel.z) / 3;
    default:
      return texel.x;
  }
}

/// An image of the size of another, from a function of the place.
template <typename Texel>
Texture make(int width, int height, Texel&& texel) {
  std::vector<vec4> texels;
  texels.reserve(static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) texels.push_back(texel(x, y));
  }
  return Texture(width, height, texels);
}

/// A place beside the image, in it.
int wrapped(int i, int size, Wrap wrap) {
  if (wrap == Wrap::Repeat) return (i + size) % size;
  return std::clamp(i, 0, size - 1);  // mirroring repeats the border texel, too
}

}  // namespace

Texture pack_metallic_roughness(const Texture* roughness, char roughness_channel, const Texture* metallic,
                                char metallic_channel) {
  int width = 1, height = 1;
  for (const Texture* image : {roughness, metallic}) {
    if (image) width = std::max(width, image->width()), height = std::max(height, image->height());
  }
  const auto value = [&](const Texture* image, char channel, int x, int y) {
    if (!image) return 1.0f;
    const auto from = [](int i, int size, int of) { return static_cast<int>(int64_t{i} * of / size); };
    return pick(image->texel(image->level(0), from(x, width, image->width()), from(y, height, image->height())),
                channel);
  };
  return make(width, height, [&](int x, int y) {
    return vec4(1, value(roughness, roughness_channel, x, y), value(metallic, metallic_channel, x, y), 1);
  });
}

Texture mask_of_channel(const Texture& image, char channel) {
  return make(image.width(), image.height(),
              [&](int x, int y) { return vec4(1, 1, 1, pick(image.texel(image.level(0), x, y), channel)); });
}

Texture normals_of_heights(const Texture& heights, char channel, float scale, Wrap wrap) {
  const int width = heights.width(), height = heights.height();
  const auto at = [&](int x, int y) {
    return pick(heights.texel(heights.level(0), wrapped(x, width, wrap), wrapped(y, height, wrap)), channel);
  };
  return make(width, height, [&](int x, int y) {
    const float right = 0.5f * scale * (at(x + 1, y) - at(x - 1, y));
    const float up = 0.5f * scale * (at(x, y - 1) - at(x, y + 1));  // rows go down
    return vec4(0.5f + 0.5f * glm::normalize(vec3(-right, -up, 1)), 1);
  });
}

bool looks_like_normals(const Texture& image) {
  const vec4 mean = image.mean();
  return std::abs(mean.x - 0.5f) < 0.15f && std::abs(mean.y - 0.5f) < 0.15f && mean.z > 0.7f;
}

}  // namespace farfield
