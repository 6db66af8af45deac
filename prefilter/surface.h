// SPDX-License-Identifier: Apache-2.0
// The surface that the bake works on: triangles in full precision, one material per face.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/vec.h"
#include "scattering/sheet.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// Prefilterable reflectance of one face. All linear RGB, in [0, 1] where nothing else is said; all channels average
/// linearly (thesis 8.3.5).
struct FaceMaterial {
  SymMat3 sggx;             ///< distribution of normals, local space, n n^T for a flat face
  vec3 diffuse{0.0f};       ///< diffuse albedo
  vec3 specular{0.0f};      ///< reflectance at normal incidence (F0)
  vec3 transmission{0.0f};  ///< diffuse transmission albedo; diffuse + transmission <= 1
  float roughness2 = 1.0f;  ///< alpha^2 of the specular GGX lobe, alpha = roughness^2 (glTF roughness)
  SymMat3 shading_sggx;     ///< the same of shading normals; 0 on all faces of a surface that has no such normals
  float opacity = 1.0f;     ///< share of rays that the face stops
  vec3 emission{0.0f};      ///< linear radiance of both sides, >= 0, may exceed 1
  float gap = 0.0f;  ///< share of paths that pass between the pieces that the face stands for; of sheets, along n
  SheetShape sheet;  ///< of these pieces, whose projected areas squared are sggx

  /// What light sees of the face's normals.
  const SymMat3& seen_normals() const { return shading_sggx.trace() > 0 ? shading_sggx : sggx; }
  /// The normals of the flakes that stand for the face. They make both the look of a volume and its attenuation along
  /// each direction: so they are those that light sees, but bent away from the face's own by no more than 30 degrees.
  SymMat3 flake_normals() const;
  /// The share of rays that the face stops; of rays towards w at a face with unit normal n.
  float stopped_share() const { return opacity * (1 - gap); }
  float stopped_share(const vec3& n, const vec3& w) const {
    return sheet.is_sheet() ? opacity * (1 - sheet_gap(sheet, gap, sheet_areas(sggx, n, w))) : stopped_share();
  }
};

/// A triangle soup or mesh with shared vertices. Winding may be inconsistent; faces are two-sided.
struct Surface {
  std::vector<vec3> positions;          ///< relative to `origin`, finite
  std::vector<uvec3> triangles;         ///< indices < positions.size(), no repeated index
  std::vector<FaceMaterial> materials;  ///< one per triangle
  dvec3 origin{0.0};  ///< of positions in the source's space; (0,0,0) unless the source lies far from its origin
  /// One per triangle: the two halves of a quad have the same number, which no other triangle has; kNoIndex: half of
  /// none. A half whose other half is gone is a triangle like others. Empty: there are no quads.
  std::vector<uint32_t> quad;

  Box3 bounds() const;
  bool has_quads() const { return !quad.empty(); }
};

}  // namespace farfield
