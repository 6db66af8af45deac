// SPDX-License-Identifier: Apache-2.0
// Heights of displacement maps: one channel in floats, as EXR files have them, with all their half-size means.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/surface_material.h"
#include "base/vec.h"

namespace farfield {

/// Immutable once made.
class HeightMap {
 public:
  /// values: width * height, row by row from the top; both sides >= 1. Those that are not finite (sculpting programs
  /// leave them outside the islands of uv) get the mean of the smallest square around them that has any; if the whole
  /// map has none, 0.
  HeightMap(int width, int height, std::vector<float> values);

  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }
  /// The map's own values, mended.
  const std::vector<float>& values() const { return levels_[0].values; }
  float least() const { return least_; }
  float most() const { return most_; }
  /// How many values were not finite, and the number of the first.
  size_t mended_count() const { return mended_count_; }
  size_t first_mended() const { return first_mended_; }

  /// The mean over about `footprint` texels (both ways; 1 and less: the map itself, bilinear) at uv, which must be
  /// finite; v points down.
  float at(const vec2& uv, float footprint, Wrap wrap_u, Wrap wrap_v) const;

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<float> values;
  };

  static Level half_size(const Level& in);
  static float look_up(const Level& level, const vec2& uv, Wrap wrap_u, Wrap wrap_v);
  void mend();

  std::vector<Level> levels_;
  float least_ = 0, most_ = 0;
  size_t mended_count_ = 0, first_mended_ = 0;
};

}  // namespace farfield
