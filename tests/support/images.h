// SPDX-License-Identifier: Apache-2.0
// Images in memory.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "import/texture.h"

namespace farfield::test {

/// A square image of `side`^2 texels: texel(x, y), y from the top, linear RGBA with straight alpha.
inline std::shared_ptr<const Texture> image(int side, const std::function<vec4(int, int)>& texel) {
  std::vector<vec4> texels;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) texels.push_back(texel(x, y));
  }
  return std::make_shared<const Texture>(side, side, texels);
}

}  // namespace farfield::test
