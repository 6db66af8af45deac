// SPDX-License-Identifier: Apache-2.0
// Rendered pictures, made up: what they show and how noisy they are is known.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/vec.h"
#include "evaluate/view_sums.h"
#include "path_tracer/image.h"

namespace farfield::test {

/// A picture R, G, B, A from its pixels.
inline Image picture(int width, int height, const std::function<vec4(int x, int y)>& pixel) {
  Image image(width, height, {"R", "G", "B", "A"});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const vec4 value = pixel(x, y);
      for (int c = 0; c < 4; ++c) image.pixel(x, y)[c] = value[c];
    }
  return image;
}

inline Image constant_picture(int width, int height, const vec4& value) {
  return picture(width, height, [&](int, int) { return value; });
}

inline float normal(Rng& rng) {  // Box and Muller
  const float u = 1.0f - rng.next(), v = rng.next();
  return std::sqrt(-2.0f * std::log(u)) * std::cos(2.0f * kPi * v);
}

/// Independent parts of the picture: Gaussian noise such that their mean has noise of standard deviation sigma.
inline std::vector<Image> noisy_parts(const Image& truth, float sigma, uint64_t seed) {
  Rng rng(seed);
  std::vector<Image> parts(kParts, truth);
  for (Image& part : parts)
    for (float& value : part.values) value += sigma * std::sqrt(static_cast<float>(kParts)) * normal(rng);
  return parts;
}

}  // namespace farfield::test
