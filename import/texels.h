// SPDX-License-Identifier: Apache-2.0
// Texels of images, whatever is in them: those beyond the border, and those that one of half the size covers.
#pragma once

#include <algorithm>

#include "base/surface_material.h"

namespace farfield {

/// The texel that is seen in place of number i of a row of `size`. |i| up to 2^30.
inline int wrapped_texel(int i, int size, Wrap mode) {
  switch (mode) {
    case Wrap::Clamp:
      return std::clamp(i, 0, size - 1);
    case Wrap::Mirror: {
      const int period = 2 * size, k = ((i % period) + period) % period;
      return k < size ? k : period - 1 - k;
    }
    case Wrap::Repeat:
      break;
  }
  return ((i % size) + size) % size;
}

struct ImageSize {
  int width = 0, height = 0;
};

/// Rounded down, at least 1.
inline ImageSize half_of(const ImageSize& size) { return {std::max(1, size.width / 2), std::max(1, size.height / 2)}; }

/// Calls visit(x, y, area) for the texels of an image that texel (x_out, y_out) of half_of() it covers, with the area
/// that it covers of each, also of odd sizes: means of means are the exact mean of the image. Real: of areas.
template <typename Real, typename Visit>
void for_each_covered_texel(const ImageSize& in, int x_out, int y_out, const Visit& visit) {
  const ImageSize out = half_of(in);
  const auto overlap = [](int i, Real begin, Real end) {
    return std::max(Real(0), std::min(static_cast<Real>(i + 1), end) - std::max(static_cast<Real>(i), begin));
  };
  const Real step_x = static_cast<Real>(in.width) / static_cast<Real>(out.width);
  const Real step_y = static_cast<Real>(in.height) / static_cast<Real>(out.height);
  const Real x0 = static_cast<Real>(x_out) * step_x, x1 = x0 + step_x;
  const Real y0 = static_cast<Real>(y_out) * step_y, y1 = y0 + step_y;
  for (int y = static_cast<int>(y0); y < in.height && static_cast<Real>(y) < y1; ++y) {
    for (int x = static_cast<int>(x0); x < in.width && static_cast<Real>(x) < x1; ++x) {
      visit(x, y, overlap(x, x0, x1) * overlap(y, y0, y1));
    }
  }
}

}  // namespace farfield
