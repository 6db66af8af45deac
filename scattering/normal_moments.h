// SPDX-License-Identifier: Apache-2.0
// Between an SGGX matrix and the second moments of its normals. Averages of n n^T over faces are moments; taken for S
// themselves they make flakes rounder than the faces: of leaves that lie about level a fifth too many stand on edge
// (docs/decisions/0025). In their common eigenvectors, since the integral of D is 4 R_G,
//
//   moment_i = integral of D m_i^2 / integral of D = 2 d ln R_G / d ln lambda_i.
#pragma once

#include "scattering/sym_mat3.h"

namespace farfield {

/// The mean of m m^T over the area of flakes with matrix S; trace 1, 0 for S = 0.
SymMat3 normal_moments(const SymMat3& s);
/// S of the flakes whose normals have these moments, of any trace; largest eigenvalue 1, 0 for 0. The same matrix, but
/// for its scale, for flat, round, and isotropic fibrous moments. Relative error of eigenvalues below 1e-3.
SymMat3 sggx_of_moments(const SymMat3& moments);

}  // namespace farfield
