// SPDX-License-Identifier: Apache-2.0
// Areas of faces, in double: single precision calls needles flat.
#pragma once

#include "prefilter/surface.h"
#include "prefilter/triangle_pieces.h"

namespace farfield {

inline double face_area(const Surface& surface, size_t face) {
  return 0.5 * glm::length(area_vector_of(corners_of(surface, face)));
}

inline double surface_area(const Surface& surface) {
  double area = 0;
  for (size_t f = 0; f < surface.triangles.size(); ++f) area += face_area(surface, f);
  return area;
}

}  // namespace farfield
