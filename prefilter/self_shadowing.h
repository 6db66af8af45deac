// SPDX-License-Identifier: Apache-2.0
// How much of the light that a voxel's geometry scatters gets away, compared with what its medium would let away
// (after thesis 14.1.4, algorithm Iso; docs/decisions/0010).
#pragma once

#include <vector>

#include "base/vec.h"
#include "scattering/sym_mat3.h"

namespace farfield {

/// Bounds of EscapeSums::ratio(). A resolved surface that becomes a medium loses half of what it scatters once, so
/// nothing needs more than 2.
inline constexpr double kLeastEscape = 0.02, kMostEscape = 2;

/// Sums over light that leaves points of one voxel's geometry. Not thread safe.
class EscapeSums {
 public:
  /// Light of `weight` >= 0 leaves in `direction` (unit), and gets a length away past the geometry, or not.
  void add(const vec3& direction, float weight, bool gets_away);
  /// The light that gets away by what would get as far in an SGGX medium of this density, within the bounds above; 1
  /// where nothing was added. Below 1 geometry is clumped: the medium needs self-shadowing A = ratio. Above 1 it is
  /// smooth: the medium shadows more than it should. s, density and length as in density.h. Pure.
  double ratio(const SymMat3& s, double density, double length) const;

 private:
  struct Light {
    vec3 direction;
    float weight;
  };
  std::vector<Light> light_;
  double away_ = 0;
};

}  // namespace farfield
