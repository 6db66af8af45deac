// SPDX-License-Identifier: Apache-2.0
// SGGX matrices in few bytes (thesis 10.1.3; docs/theory.md, section 10.10): sigma_i = sqrt(S_ii) and correlations
// r_ij = S_ij / (sigma_i sigma_j), for S scaled to lambda_max(S) = 1.
#pragma once

#include <array>
#include <cstdint>

#include "scattering/sym_mat3.h"

namespace farfield {

/// 6 bytes, for flakes: sigma as unorm8 (x, y, z), correlations (xy, xz, yz) as q / 127.
struct PackedFlakeSggx {
  std::array<uint8_t, 3> sigma;
  std::array<int8_t, 3> correlation;
  friend bool operator==(const PackedFlakeSggx&, const PackedFlakeSggx&) = default;
};
static_assert(sizeof(PackedFlakeSggx) == 6);

/// 12 bytes, for surfaces, which need more: sigma as unorm16, correlations as q / 32767. A GGX alpha of 0.01 is an
/// eigenvalue of 1e-4.
struct PackedSurfaceSggx {
  std::array<uint16_t, 3> sigma;
  std::array<int16_t, 3> correlation;
  friend bool operator==(const PackedSurfaceSggx&, const PackedSurfaceSggx&) = default;
};
static_assert(sizeof(PackedSurfaceSggx) == 12);

/// Packs s / lambda_max(s). Whatever is packed unpacks to a positive semidefinite matrix; the error is measured in
/// docs/results/light.md. s must be PSD up to rounding; s = 0 packs to 0.
PackedFlakeSggx pack_flake_sggx(const SymMat3& s);
PackedSurfaceSggx pack_surface_sggx(const SymMat3& s);

/// The matrix, lambda_max about 1. Any bytes give finite entries; bytes that pack_ made give a PSD matrix.
SymMat3 unpack(const PackedFlakeSggx& packed);
SymMat3 unpack(const PackedSurfaceSggx& packed);

}  // namespace farfield
