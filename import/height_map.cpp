// SPDX-License-Identifier: Apache-2.0
#include "import/height_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "import/texels.h"

namespace farfield {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

size_t index_of(int x, int y, int width) {
  return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
}

/// A coordinate folded into where the image is looked up; then it is small enough for an integer.
double folded(double x, Wrap wrap) {
  switch (wrap) {
    case Wrap::Repeat:
      return x - std::floor(x);
    case Wrap::Mirror: {
      const double in_pair = x - 2 * std::floor(0.5 * x);
      return in_pair <= 1 ? in_pair : 2 - in_pair;
    }
    case Wrap::Clamp:
      break;
  }
  return std::clamp(x, 0.0, 1.0);
}

}  // namespace

HeightMap::HeightMap(int width, int height, std::vector<float> values) {
  FARFIELD_CHECK(width >= 1 && height >= 1);
  FARFIELD_CHECK(values.size() == static_cast<size_t>(width) * static_cast<size_t>(height));
  for (size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    values[i] = kNone;
    if (mended_count_++ == 0) first_mended_ = i;
  }
  levels_.push_back({width, height, std::move(values)});
  while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(half_size(levels_.back()));
  mend();
  const auto [least, most] = std::ranges::minmax_element(levels_[0].values);
  least_ = *least;
  most_ = *most;
}

/// Each value is the mean of what is finite in the area that it covers; none: NaN.
HeightMap::Level HeightMap::half_size(const Level& in) {
  const ImageSize size{in.width, in.height}, half = half_of(size);
  Level out{half.width, half.height, {}};
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      double sum = 0, area = 0;
      for_each_covered_texel<double>(size, x, y, [&](int u, int v, double covered) {
        const float value = in.values[index_of(u, v, in.width)];
        if (std::isnan(value)) return;
        sum += covered * value;
        area += covered;
      });
      out.values.push_back(area > 0 ? static_cast<float>(sum / area) : kNone);
    }
  }
  return out;
}

/// From the smallest size to the largest, so that each hole gets the nearest mean that there is.
void HeightMap::mend() {
  if (mended_count_ == 0) return;
  if (std::isnan(levels_.back().values[0])) levels_.back().values[0] = 0;
  for (size_t level = levels_.size() - 1; level-- > 0;) {
    Level& fine = levels_[level];
    const Level& coarse = levels_[level + 1];
    for (int y = 0; y < fine.height; ++y) {
      for (int x = 0; x < fine.width; ++x) {
        float& value = fine.values[index_of(x, y, fine.width)];
        if (!std::isnan(value)) continue;
        value =
            coarse
                .values[index_of(std::min(x / 2, coarse.width - 1), std::min(y / 2, coarse.height - 1), coarse.width)];
      }
    }
  }
}

/// Bilinear between the middles of texels.
float HeightMap::look_up(const Level& level, const vec2& uv, Wrap wrap_u, Wrap wrap_v) {
  const double x = folded(uv.x, wrap_u) * level.width - 0.5, y = folded(uv.y, wrap_v) * level.height - 0.5;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const auto value = [&](int column, int row) {
    return level.values[index_of(wrapped_texel(column, level.width, wrap_u), wrapped_texel(row, level.height, wrap_v),
                                 level.width)];
  };
  const double s = x - x0, t = y - y0;
  const double upper = (1 - s) * value(x0, y0) + s * value(x0 + 1, y0);
  const double lower = (1 - s) * value(x0, y0 + 1) + s * value(x0 + 1, y0 + 1);
  return static_cast<float>((1 - t) * upper + t * lower);
}

float HeightMap::at(const vec2& uv, float footprint, Wrap wrap_u, Wrap wrap_v) const {
  const float last = static_cast<float>(levels_.size() - 1);
  const float level = footprint > 1 ? std::min(std::log2(footprint), last) : 0.0f;
  const auto fine = static_cast<size_t>(level);
  const float share = level - static_cast<float>(fine);
  const float value = look_up(levels_[fine], uv, wrap_u, wrap_v);
  return share > 0 ? (1 - share) * value + share * look_up(levels_[fine + 1], uv, wrap_u, wrap_v) : value;
}

}  // namespace farfield
