// SPDX-License-Identifier: Apache-2.0
#include "evaluate/difference_image.h"

#include "base/check.h"
#include "base/vec.h"

namespace farfield {
namespace {

vec3 read_rgb(const Image& image, int x, int y) {
  const float* p = image.pixel(x, y);
  return {p[0], p[1], p[2]};
}

/// sRGB without its linear toe: where differences are formed, as the eye sees them.
vec3 to_display(const vec3& linear) { return glm::pow(glm::clamp(linear, 0.0f, 1.0f), vec3(1.0f / 2.2f)); }
vec3 to_linear(const vec3& display) { return glm::pow(glm::clamp(display, 0.0f, 1.0f), vec3(2.2f)); }

}  // namespace

Image difference_image(const Image& source, const Image& level) {
  FARFIELD_CHECK(source.width == level.width && source.height == level.height);
  Image out(source.width, source.height, {"R", "G", "B"});
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      const vec3 signed_difference = to_display(read_rgb(level, x, y)) - to_display(read_rgb(source, x, y));
      const vec3 shown = to_linear(0.5f + 2.0f * signed_difference);
      for (int c = 0; c < 3; ++c) out.pixel(x, y)[c] = shown[c];
    }
  return out;
}

}  // namespace farfield
