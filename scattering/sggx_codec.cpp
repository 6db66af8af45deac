// SPDX-License-Identifier: Apache-2.0
#include "scattering/sggx_codec.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scattering/sggx.h"

namespace farfield {
namespace {

/// Correlations as integers; kOne stands for 1.
struct Correlations {
  int xy, xz, yz;
};

/// Exact: a unit diagonal, entries within [-one, one] and det >= 0 is a positive semidefinite matrix.
bool is_semidefinite(const Correlations& q, int64_t one) {
  const int64_t a = q.xy, b = q.xz, c = q.yz;
  return one * (one * one - a * a - b * b - c * c) + 2 * a * b * c >= 0;
}

int round_to(double correlation, int one) {
  return static_cast<int>(std::lround(std::clamp(correlation, -1.0, 1.0) * one));
}

// Rounding pushes about half of the near-singular matrices out of the cone. Somewhere within one unit of each rounded
// entry there is one inside: (one - 1) / one times the correlations, rounded, is (docs/theory.md, section 10.10). The
// nearest is taken.
Correlations quantise(double xy, double xz, double yz, int one) {
  const Correlations nearest{round_to(xy, one), round_to(xz, one), round_to(yz, one)};
  if (is_semidefinite(nearest, one)) return nearest;
  Correlations best = nearest;
  double best_error = std::numeric_limits<double>::infinity();
  for (int a = -1; a <= 1; ++a) {
    for (int b = -1; b <= 1; ++b) {
      for (int c = -1; c <= 1; ++c) {
        const Correlations q{std::clamp(nearest.xy + a, -one, one), std::clamp(nearest.xz + b, -one, one),
                             std::clamp(nearest.yz + c, -one, one)};
        const double dx = q.xy - xy * one, dy = q.xz - xz * one, dz = q.yz - yz * one;
        const double error = dx * dx + dy * dy + dz * dz;
        if (error < best_error && is_semidefinite(q, one)) best = q, best_error = error;
      }
    }
  }
  if (std::isfinite(best_error)) return best;
  // Only for what was not semidefinite to begin with.
  return quantise(xy * 0.9, xz * 0.9, yz * 0.9, one);
}

template <typename Packed, int kSigmaOne, int kCorrelationOne>
Packed pack(const SymMat3& s) {
  const double largest = eigenvalues(s).x;
  if (!(largest > 0) || !std::isfinite(largest)) return {};
  const double sigma[3] = {std::sqrt(std::max(0.0, s.xx / largest)), std::sqrt(std::max(0.0, s.yy / largest)),
                           std::sqrt(std::max(0.0, s.zz / largest))};
  const auto correlation = [&](double entry, int i, int j) {
    const double scale = sigma[i] * sigma[j];
    return scale > 0 ? std::clamp(entry / (largest * scale), -1.0, 1.0) : 0.0;
  };
  const Correlations q =
      quantise(correlation(s.xy, 0, 1), correlation(s.xz, 0, 2), correlation(s.yz, 1, 2), kCorrelationOne);
  Packed packed{};
  using Sigma = std::remove_reference_t<decltype(packed.sigma[0])>;
  using Correlation = std::remove_reference_t<decltype(packed.correlation[0])>;
  for (int i = 0; i < 3; ++i) {
    packed.sigma[i] = static_cast<Sigma>(std::lround(std::min(sigma[i], 1.0) * kSigmaOne));
  }
  packed.correlation = {static_cast<Correlation>(q.xy), static_cast<Correlation>(q.xz), static_cast<Correlation>(q.yz)};
  return packed;
}

template <typename Packed>
SymMat3 unpack_scaled(const Packed& packed, float sigma_unit, float correlation_unit) {
  const float x = packed.sigma[0] * sigma_unit, y = packed.sigma[1] * sigma_unit, z = packed.sigma[2] * sigma_unit;
  const auto r = [&](int i) { return std::max(-1.0f, packed.correlation[i] * correlation_unit); };
  return {x * x, y * y, z * z, r(0) * x * y, r(1) * x * z, r(2) * y * z};
}

}  // namespace

PackedFlakeSggx pack_flake_sggx(const SymMat3& s) { return pack<PackedFlakeSggx, 255, 127>(s); }
PackedSurfaceSggx pack_surface_sggx(const SymMat3& s) { return pack<PackedSurfaceSggx, 65535, 32767>(s); }

SymMat3 unpack(const PackedFlakeSggx& packed) { return unpack_scaled(packed, 1.0f / 255, 1.0f / 127); }
SymMat3 unpack(const PackedSurfaceSggx& packed) { return unpack_scaled(packed, 1.0f / 65535, 1.0f / 32767); }

}  // namespace farfield
