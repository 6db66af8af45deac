// SPDX-License-Identifier: Apache-2.0
// Carlson's symmetric elliptic integral R_G: the spherical mean of sqrt(w^T S w) is R_G of the eigenvalues of S,
// exactly (DLMF 19.16(ii)). It normalises the SGGX distribution: the integral of D is 4 R_G.
#pragma once

namespace farfield {

/// R_G(x, y, z), arguments >= 0 in any order, any number of them 0. Homogeneous of degree 1/2. By duplication [Carlson
/// 1995], relative error below 1e-14.
double carlson_rg(double x, double y, double z);
/// The same to float precision, relative error below 1e-6.
float carlson_rg(float x, float y, float z);

}  // namespace farfield
