// SPDX-License-Identifier: Apache-2.0
// From an SGGX distribution to a mixture of trigonometric lobes with the same attenuation in every direction.
#pragma once

#include "scattering/media/trig_lobe.h"

namespace farfield {

struct LobeFit {
  LobeMixture flakes;
  float rho_factor = 0;  ///< rho of the lobes (normalised scaling) = rho_factor * rho of the SGGX distribution
  float rms_error = 0;   ///< of sigma_t over directions, relative
};

/// The best mixture of one cosine lobe about the eigenvector of the largest eigenvalue, one sine lobe about that of the
/// smallest, and the isotropic lobe: non-negative least squares on the relative error of sigma, for every pair of
/// exponents (thesis 13.1.2 gives no recipe; docs/theory.md, section 3.6). Lobes cannot get below sigma_min / sigma_max
/// of 0.125 (cosine) or 0.195 (sine): sharper distributions fit with the error that rms_error reports. S = 0 gives
/// rho_factor 0. About a millisecond. Pure; any thread.
LobeFit fit_lobes(const SymMat3& s);

}  // namespace farfield
