// SPDX-License-Identifier: Apache-2.0
// Averages of SGGX volumes that keep the matrix positive semidefinite and the attenuation right in the mean.
#pragma once

#include "scattering/sym_mat3.h"

namespace farfield {

/// Flakes of one voxel, SGGX scaling (scattering/convention.h): sigma_t(w) = rho sqrt(w^T S w).
struct SggxFlakes {
  SymMat3 sggx;   ///< lambda_max = 1, or 0 for an empty voxel
  float rho = 0;  ///< 1/length
};

/// Collects voxels and averages them. S is averaged with the weights rho_i, which keeps it PSD; rho follows from
/// sum rho_i R_G(S_i) = rho R_G(S), so that the mean attenuation over directions is exactly that of the parts.
/// (Averages of S and rho apart attenuate too much: sigma of the mean matrix is at least the mean of the sigmas.)
class SggxAverage {
 public:
  /// weight >= 0: the share of volume. The scale of flakes.sggx does not matter, only rho sigma does.
  void add(const SggxFlakes& flakes, float weight);
  /// Empty if nothing but empty voxels was added.
  SggxFlakes result() const;

 private:
  SymMat3 weighted_;
  double extinction_ = 0;  ///< sum weight rho R_G
  double weight_ = 0;
};

/// Between two voxels, t in [0, 1]: the average with weights 1 - t and t.
SggxFlakes lerp(const SggxFlakes& a, const SggxFlakes& b, float t);

}  // namespace farfield
