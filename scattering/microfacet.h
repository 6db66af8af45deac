// SPDX-License-Identifier: Apache-2.0
// Ellipsoid distributions of microfacets on a surface with geometric normal n, for any S against n
// (thesis 8.3.9-8.3.11; derivation: docs/theory.md, section 5). An aligned S = alpha^2 (I - n n^T) + n n^T is GGX with
// Smith masking.
#pragma once

#include "scattering/sggx.h"

namespace farfield {

/// How masking on the way in and out are combined.
enum class Masking {
  Separable,        ///< G1(wo) G1(wi)
  HeightCorrelated  ///< 1 / (1/G1(wo) + 1/G1(wi) - 1)
};

/// Microfacets with m.n > 0. S counts only up to scale. Immutable; any thread.
template <typename T>
class BasicMicrofacets {
 public:
  /// The share of tr(S) that n^T S n has at least: a distribution with all facets edge-on to the surface is nothing one
  /// could see, so n n^T is added up to this.
  static constexpr double kSmallestUprightShare = 1e-2;

  BasicMicrofacets() = default;
  /// S = 0 or a broken S is taken as flat: n n^T.
  BasicMicrofacets(const SymMat3& s, const Vec3<T>& n);

  /// Density of facets per projected surface area: the integral of D (m.n) over m.n > 0 is 1. m.n > 0 is the caller's
  /// to know.
  T ndf(const Vec3<T>& m) const {
    const Vec3<T> u = b_.solve(m);
    const T u2 = glm::dot(u, u);
    return u2 > 0 ? T(1) / (kPiOf<T> * b_.determinant() * u2 * u2) : T(0);
  }

  /// a(w) = int D <w.m> dm over m.n > 0: projected area of the facets that face w, masked or not.
  T projected_area(const Vec3<T>& w) const {
    const Vec3<T> x = b_.transposed_times(w);
    return T(0.5) * std::max(T(0), glm::length(x) + glm::dot(x, upright_));
  }

  /// A facet visible from w, w.n > 0, with density D(m) <w.m> / a(w): a spherical cap, no rejection.
  Vec3<T> sample_visible(const Vec3<T>& w, T u1, T u2) const {
    const Vec3<T> w1 = glm::normalize(b_.transposed_times(w));
    const T tilt = glm::dot(w1, upright_);
    const T z = (T(1) - u1) * (T(1) + tilt) - tilt;
    const Vec3<T> h = BasicFrame<T>(upright_).to_world(direction_at_height(std::min(z, T(1)), u2)) + w1;
    return glm::normalize(b_ * (glm::dot(h, h) > 0 ? h : upright_));
  }

 private:
  CholeskyFactor<T> b_;  ///< scaled so that sigma(n) = 1
  Vec3<T> upright_{0};   ///< B^T n, unit
};

using Microfacets = BasicMicrofacets<float>;

/// 1/G1 of the clamped masking: at least 1, infinite as cos -> 0. cos = w.n > 0, area = a(w).
template <typename T>
T inverse_g1(T cos, T area) {
  return std::max(T(1), area / cos);
}

/// G2 / G1u(wo), G1u = cos / area the unclamped masking: the weight of a sampled facet; at most 1, and reciprocal with
/// the unclamped form in the denominator (erratum of 8.3.10).
template <Masking kMasking, typename T>
T masking_weight(T cos_o, T area_o, T cos_i, T area_i) {
  const T inverse_i = inverse_g1(cos_i, area_i);
  if constexpr (kMasking == Masking::Separable) return area_o / (std::max(cos_o, area_o) * inverse_i);
  return area_o / (std::max(cos_o, area_o) + cos_o * (inverse_i - T(1)));
}

}  // namespace farfield
