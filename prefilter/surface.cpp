// SPDX-License-Identifier: Apache-2.0
#include "prefilter/surface.h"

namespace farfield {

Box3 Surface::bounds() const {
  Box3 box;
  for (const uvec3& triangle : triangles) {
    for (int k = 0; k < 3; ++k) box.extend(positions[triangle[k]]);
  }
  return box;
}

}  // namespace farfield
