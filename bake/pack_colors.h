// SPDX-License-Identifier: Apache-2.0
// Albedos as bytes without a bias: what rounding takes from one, the next ones give back.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/vec.h"
#include "cache/level.h"

namespace farfield {

/// Rounds colours that come in the order in which they are stored, so that the mean of neighbours is right although one
/// byte's step is up to 6 % of a dark albedo: error diffusion [Floyd and Steinberg 1976] along the order. 0, 1 and
/// what a byte can say are stored as they are.
class ColorRounder {
 public:
  PackedColor operator()(const vec3& linear_rgb);

 private:
  vec3 owed_{0.0f};  ///< what earlier colours lost, linear
};

/// get(source) is the colour of an element, linear RGB in [0, 1].
template <class Source, class Get>
std::vector<PackedColor> pack_colors(const std::vector<Source>& source, const Get& get) {
  std::vector<PackedColor> packed;
  packed.reserve(source.size());
  ColorRounder round;
  for (const Source& element : source) packed.push_back(round(get(element)));
  return packed;
}

}  // namespace farfield
