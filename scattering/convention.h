// SPDX-License-Identifier: Apache-2.0
// The one convention of scattering/. Every eval, sample and pdf of this room means what is written here.
//
// Directions   wo and wi are unit and point away from the point; wo is where light goes (the viewer), wi where it comes
//              from. m is a flake's or facet's normal, h = (wo + wi) / |wo + wi|. <x> = max(x, 0).
// Measures     pdf: per steradian of the sampled direction. eval of a phase function: per steradian, includes the
//              albedo when its name says albedo. eval of a surface: f |n.wi|.
// Samples      weight = eval / true density of the sample; a zero weight is a failed sample (count it as black).
// Media        sigma_t(w) = rho sigma(w), in 1/length. D is even: D(m) = D(-m), over the whole sphere.
//
// Three scalings of (rho, D) are in use; only rho D enters sigma_t, and phase functions do not depend on it
// (docs/theory.md, section 1):
//
// clang-format off
//               D                                 sigma(w)          isotropic  rho is
//   SGGX        1 / (pi sqrt|S| (m^T S^-1 m)^2),  sqrt(w^T S w)     1          with lambda_max(S) = 1: the largest
//               int D = 4 R_G(eigenvalues)        = int D <w.m> dm             attenuation coefficient
//   normalised  int D = 1                         int D <w.m> dm    1/4        flake area per volume, both faces
//   (lobes)
//   Jakob 2010  int D = 1                         int D |w.m| dm    1/2        one-sided flake area per volume
// clang-format on
//
// Farfield stores the SGGX scaling with lambda_max(S) = 1, and the normalised one for trigonometric lobes. Rescaling
// S -> S / c asks for rho -> rho sqrt(c). Averages of S do not have lambda_max = 1: rescale them.
#pragma once

#include "base/vec.h"

namespace farfield {

template <typename T>
using Vec3 = glm::vec<3, T>;

template <typename T>
inline constexpr T kPiOf = T(3.141592653589793238462643383279502884L);

/// rho of the normalised scaling from rho of the SGGX one. mean_sigma: R_G of the eigenvalues (scattering/carlson.h).
template <typename T>
T normalised_rho(T sggx_rho, T mean_sigma) {
  return T(4) * mean_sigma * sggx_rho;
}

/// The inverse of normalised_rho; 0 for an empty distribution (mean_sigma = 0).
template <typename T>
T sggx_rho(T normalised_rho, T mean_sigma) {
  return mean_sigma > 0 ? normalised_rho / (T(4) * mean_sigma) : T(0);
}

}  // namespace farfield
