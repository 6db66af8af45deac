// SPDX-License-Identifier: Apache-2.0
#include "import/texture.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace farfield {
namespace {

/// How much of input texel `i` lies in [begin, end), for the box filter of one axis.
float overlap(int i, float begin, float end) {
  return std::max(0.0f, std::min(static_cast<float>(i + 1), end) - std::max(static_cast<float>(i), begin));
}

/// Half the size (rounded down, at least 1). Each output texel is the exact mean of the area it covers, also for odd
/// sizes, so the last level is the exact mean of the image.
Texture::Level half_size(const Texture::Level& in) {
  Texture::Level out;
  out.width = std::max(1, in.width / 2);
  out.height = std::max(1, in.height / 2);
  out.texels.resize(static_cast<size_t>(out.width) * static_cast<size_t>(out.height));
  const float step_x = static_cast<float>(in.width) / static_cast<float>(out.width);
  const float step_y = static_cast<float>(in.height) / static_cast<float>(out.height);
  for (int y = 0; y < out.height; ++y) {
    const float y0 = static_cast<float>(y) * step_y, y1 = y0 + step_y;
    for (int x = 0; x < out.width; ++x) {
      const float x0 = static_cast<float>(x) * step_x, x1 = x0 + step_x;
      vec4 sum(0.0f);
      float weight = 0;
      for (int v = static_cast<int>(y0); v < in.height && static_cast<float>(v) < y1; ++v) {
        for (int u = static_cast<int>(x0); u < in.width && static_cast<float>(u) < x1; ++u) {
          const float w = overlap(u, x0, x1) * overlap(v, y0, y1);
          const auto& t = in.texels[static_cast<size_t>(v) * static_cast<size_t>(in.width) + static_cast<size_t>(u)];
          sum += w * vec4(t[0], t[1], t[2], t[3]);
          weight += w;
        }
      }
      auto& t = out.texels[static_cast<size_t>(y) * static_cast<size_t>(out.width) + static_cast<size_t>(x)];
      for (int c = 0; c < 4; ++c) t[static_cast<size_t>(c)] = static_cast<uint16_t>(std::lround(sum[c] / weight));
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
