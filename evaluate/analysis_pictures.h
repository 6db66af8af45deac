// SPDX-License-Identifier: Apache-2.0
// What the faces of a level's surfaces are, in colours. Pure; any thread.
#pragma once

#include <vector>

#include "bake/bake.h"
#include "base/result.h"
#include "path_tracer/image.h"

namespace farfield {

/// Of each simplified face.
struct FaceFigures {
  std::vector<float> size;       ///< longest side in r_k
  std::vector<float> roughness;  ///< normal_roughness()
};

inline constexpr vec3 kMacrosurfaceColor{0.10f, 0.55f, 0.12f};  ///< as in fig. 7.5; linear
inline constexpr vec3 kSubResolutionColor{0.85f, 0.25f, 0.03f};
/// Dark blue for 0 by green to yellow for 1 and above.
vec3 scale_color(float value);

/// Three pictures of one view, lit from the camera, longest side `longest_px`: macrosurface and sub-resolution geometry
/// with a circle of radius r_k, sizes of the simplified faces (scale: 0 to r_k), their roughness (scale: 0 to 1).
/// Linear R, G, B. Errors: those of RayScene.
Result<std::vector<Image>> draw_analysis(const LevelSurfaces& level, const FaceFigures& faces, const Box3& bounds,
                                         const vec3& direction, int longest_px);

}  // namespace farfield
