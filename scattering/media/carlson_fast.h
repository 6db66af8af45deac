// SPDX-License-Identifier: Apache-2.0
// A fit of R_G (scattering/carlson.h) for where 7e-4 is good enough. It is not where densities of directions are
// normalised: there its error is a bias (docs/theory.md, section 2).
#pragma once

namespace farfield {

/// R_G(x, y, z) in float from four elementary terms, relative error below 7e-4; no special cases, R_G(0, 0, 0) = 0.
float carlson_rg_fast(float x, float y, float z);

}  // namespace farfield
