// SPDX-License-Identifier: Apache-2.0
#include "import/texture.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "import/texels.h"

namespace farfield {
namespace {

/// Each output texel is the mean of the area it covers, so the last level is the exact mean of the image.
Texture::Level half_size(const Texture::Level& in) {
  const ImageSize size{in.width, in.height}, half = half_of(size);
  Texture::Level out{half.width, half.height, {}};
  out.texels.reserve(static_cast<size_t>(out.width) * static_cast<size_t>(out.height));
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      vec4 sum(0.0f);
      float area = 0;
      for_each_covered_texel<float>(size, x, y, [&](int u, int v, float covered) {
        const auto& t = in.texels[static_cast<size_t>(v) * static_cast<size_t>(in.width) + static_cast<size_t>(u)];
        sum += covered * vec4(t[0], t[1], t[2], t[3]);
        area += covered;
      });
      auto& t = out.texels.emplace_back();
      for (int c = 0; c < 4; ++c) t[static_cast<size_t>(c)] = static_cast<uint16_t>(std::lround(sum[c] / area));
    }
  }
  return out;
}

uint16_t to_unorm16(float value) {
  return static_cast<uint16_t>(std::lround(65535.0f * std::clamp(std::isnan(value) ? 0.0f : value, 0.0f, 1.0f)));
}

}  // namespace

Texture::Texture(int width, int height, std::span<const vec4> texels) {
  FARFIELD_CHECK(width >= 1 && height >= 1);
  FARFIELD_CHECK(texels.size() == static_cast<size_t>(width) * static_cast<size_t>(height));
  Level full{width, height, {}};
  full.texels.reserve(texels.size());
  for (const vec4& t : texels) {
    full.texels.push_back({to_unorm16(t.x * t.w), to_unorm16(t.y * t.w), to_unorm16(t.z * t.w), to_unorm16(t.w)});
  }
  levels_.push_back(std::move(full));
  while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(half_size(levels_.back()));
}

float srgb_to_linear(float value) {
  return value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
}

}  // namespace farfield
