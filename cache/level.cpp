// SPDX-License-Identifier: Apache-2.0
#include "cache/level.h"

#include <algorithm>
#include <cmath>

namespace farfield {

namespace {

/// [0, 1] to 0 .. 255, rounded. NaN gives 0.
uint8_t to_unorm8(float x) {
  if (!(x > 0.0f)) return 0;
  return static_cast<uint8_t>(std::lround(255.0f * std::min(x, 1.0f)));
}

}  // namespace

uint8_t pack_unorm8(float x) { return to_unorm8(x); }

PackedColor pack_color(const vec3& linear_rgb) {
  PackedColor packed;
  for (int i = 0; i < 3; ++i) packed.sqrt_rgb[static_cast<size_t>(i)] = to_unorm8(std::sqrt(linear_rgb[i]));
  return packed;
}

vec3 unpack_color(PackedColor color) {
  const vec3 root(unpack_unorm8(color.sqrt_rgb[0]), unpack_unorm8(color.sqrt_rgb[1]), unpack_unorm8(color.sqrt_rgb[2]));
  return root * root;
}

LevelView view_of(const LevelData& level) {
  LevelView view;
  view.header = level.header;
#define FARFIELD_VIEW(id, Name, field, Element, Group) view.field = level.field;
  FARFIELD_LEVEL_ARRAYS(FARFIELD_VIEW)
#undef FARFIELD_VIEW
  return view;
}

LevelData copy_of(const LevelView& level) {
  LevelData data;
  data.header = level.header;
#define FARFIELD_COPY(id, Name, field, Element, Group) data.field.assign(level.field.begin(), level.field.end());
  FARFIELD_LEVEL_ARRAYS(FARFIELD_COPY)
#undef FARFIELD_COPY
  return data;
}

}  // namespace farfield
