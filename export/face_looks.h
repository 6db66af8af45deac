// SPDX-License-Identifier: Apache-2.0
// What the faces of a level are and look like, for formats that know neither distributions of normals nor gaps.
#pragma once

#include <vector>

#include "cache/level.h"

namespace farfield {

/// Of each face its corners in LevelView::positions.
std::vector<uvec3> face_corners(const LevelView& level);

/// Linear RGB.
struct FaceLook {
  vec3 diffuse{0.0f}, specular{0.0f}, transmission{0.0f}, emission{0.0f};
  float roughness = 1;  ///< of the highlight, wider where the face stands for many normals; GGX alpha is its square
  float opacity = 1;    ///< share of rays that the face stops, gaps between pieces taken off
  double area = 0;
};
std::vector<FaceLook> face_looks(const LevelView& level, const std::vector<uvec3>& corners);

}  // namespace farfield
