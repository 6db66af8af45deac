// SPDX-License-Identifier: Apache-2.0
// What a triangle of the source, or a part of it, looks like on average: materials of faces (thesis 8.3.5).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/job.h"
#include "prefilter/source_surface.h"
#include "prefilter/surface.h"

namespace farfield {

/// A part of a source's triangle: the barycentric coordinates of its corners there.
struct TrianglePart {
  uint32_t triangle = 0;
  std::array<vec3, 3> corners{vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1)};

  vec3 at(const vec3& barycentric) const {
    return barycentric.x * corners[0] + barycentric.y * corners[1] + barycentric.z * corners[2];
  }
  bool is_whole() const { return corners == TrianglePart{}.corners; }
};

/// For each part: averages over it of textures, vertex colours, shading normals and the spread of normal maps; of a
/// host's material function over kFunctionSamples points. shading_sggx is 0 unless the source has shading normals.
/// Pure, as far as the function is. Incomplete when cancelled.
std::vector<FaceMaterial> average_materials(const SourceSurface& source, std::span<const TrianglePart> parts,
                                            const Job& job = {});
inline constexpr int kFunctionSamples = 16;

/// Whether the part would look different at some spots of this width (scene units) if it had one material: base colour,
/// roughness, emission or opacity by more than kVisibleStep, normals by more than kVisibleAngle.
bool is_varied(const SourceSurface& source, const TrianglePart& part, float width);
inline constexpr float kVisibleStep = 0.05f;   ///< of the square root of a linear value: 13 of 255 grey levels
inline constexpr float kVisibleAngle = 0.15f;  ///< rad

/// The source's triangles, each with its average material: level 0 where close-ups cannot have more. Incomplete when
/// cancelled.
Surface average_faces(const SourceSurface& source, const Job& job = {});

}  // namespace farfield
