// SPDX-License-Identifier: Apache-2.0
// What is seen of a voxel: averages over first hits, not over all that is in it.
#pragma once

#include <array>

#include "prefilter/fixed_sum.h"
#include "prefilter/surface.h"
#include "prefilter/voxelize.h"

namespace farfield {

/// Sums over the first hits in one voxel. Any thread may add.
class SeenSums {
 public:
  void add_hit(const FaceMaterial& material);
  double hits() const { return hits_.value(); }
  /// Puts the averages into a voxel, whose own count as `prior` > 0 hits. Its density is changed so that the mean
  /// attenuation over directions stays. Emission, which knows no bounds, stays as it is.
  void apply(double prior, Voxel& voxel) const;

 private:
  FixedSum hits_;
  std::array<FixedSum, 6> sggx_;
  std::array<FixedSum, 3> diffuse_, specular_, transmission_;
  FixedSum specular_weight_, weighted_roughness2_;  ///< weighted by the specular reflectance whose lobe it is
};

}  // namespace farfield
