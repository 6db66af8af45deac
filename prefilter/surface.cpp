// SPDX-License-Identifier: Apache-2.0
#include "prefilter/surface.h"

namespace farfield {
namespace {

/// The sum of products of entries.
float inner_product(const SymMat3& a, const SymMat3& b) {
  return a.xx * b.xx + a.yy * b.yy + a.zz * b.zz + 2 * (a.xy * b.xy + a.xz * b.xz + a.yz * b.yz);
}

}  // namespace

SymMat3 FaceMaterial::flake_normals() const {
  constexpr float kMostBent = 0.25f;  // squared sine of the angle between the two
  if (!(shading_sggx.trace() > 0)) return sggx;
  const float bent = 1 - inner_product(sggx, shading_sggx) / inner_product(sggx, sggx);
  const float share = bent > kMostBent ? kMostBent / bent : 1.0f;
  return sggx * (1 - share) + shading_sggx * share;
}

Box3 Surface::bounds() const {
  Box3 box;
  for (const uvec3& triangle : triangles) {
    for (int k = 0; k < 3; ++k) box.extend(positions[triangle[k]]);
  }
  return box;
}

}  // namespace farfield
