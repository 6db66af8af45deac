// SPDX-License-Identifier: Apache-2.0
// Trigonometric lobes: the distributions of flake normals cos^2n and sin^2n of the angle to an axis, whose convolutions
// with a shadowing function A(w) = w^T S w are polynomials (thesis 13.2; exact coefficients for any n, sphere integrals
// and samplers: docs/theory.md, section 3). Normalised scaling: the integral of D over the sphere is 1.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <type_traits>

#include "base/random.h"
#include "scattering/convention.h"
#include "scattering/sym_mat3.h"
#include "scattering/warp.h"

namespace farfield {

enum class LobeKind : uint8_t {
  Cosine,  ///< D ~ (m.axis)^2n: flat flakes facing the axis
  Sine     ///< D ~ (1 - (m.axis)^2)^n: fibres along the axis
};

/// Lobes go up to cos^40. 0 is the isotropic distribution.
inline constexpr int kLargestLobeExponent = 20;

/// With t = w.axis and S any symmetric matrix,
///   int D <w.m> dm              = sum sigma[j] t^2j
///   int D <w.m> w'^T S w' dm    = sum t^2j (shadow_w[j] w^T S w + shadow_axis[j] axis^T S axis + shadow_trace[j] tr S)
///                                 + t w^T S axis sum shadow_cross[j] t^2j,   w' = w mirrored at m
/// All exact; computed once from recurrences in double. Entries beyond the degree n are 0.
struct LobeCoefficients {
  static constexpr int kCount = 24;  ///< kLargestLobeExponent + 1, rounded up to whole blocks of four
  using Polynomial = std::array<double, kCount>;
  Polynomial sigma{}, shadow_w{}, shadow_axis{}, shadow_trace{}, shadow_cross{};
  double inverse_norm = 0;  ///< 1 / int (unnormalised D)
  int blocks = 0;           ///< of four coefficients, that are not all 0
};

/// The table of all lobes. n in [0, kLargestLobeExponent].
const LobeCoefficients& lobe_coefficients(LobeKind kind, int n);
const struct LobeSegments& lobe_segments(LobeKind kind, int n);

/// The same five polynomials as float cubics on equal segments of |t|: one load and three multiply-adds each instead of
/// n, without the cancellation that alternating coefficients have in float (2e-4 at n = 20). Error: trig_lobe_test.cpp.
struct LobeSegments {
  static constexpr int kCount = 64;
  struct Cubic {
    float c[4];  ///< c0 + x (c1 + x (c2 + x c3)), x in [0, 1] within the segment
    float at(float x) const { return c[0] + x * (c[1] + x * (c[2] + x * c[3])); }
  };
  struct Shadow {
    Cubic w, axis, trace, cross;
  };
  std::array<Cubic, kCount> sigma;
  std::array<Shadow, kCount> shadow;
};

/// One lobe about an axis. Immutable; any thread. In double it evaluates the polynomials, in float the segments.
template <typename T>
class BasicTrigLobe {
 public:
  /// axis: unit. n is clamped to [0, kLargestLobeExponent].
  BasicTrigLobe(LobeKind kind, int n, const Vec3<T>& axis);
  BasicTrigLobe() : BasicTrigLobe(LobeKind::Cosine, 0, Vec3<T>(0, 0, 1)) {}

  LobeKind kind() const { return kind_; }
  int exponent() const { return n_; }
  const Vec3<T>& axis() const { return axis_; }

  /// Density of normals over the whole sphere. m unit.
  T ndf(const Vec3<T>& m) const;
  /// int D <w.m> dm: attenuation per rho and A(w). In (0, 1/2].
  T sigma(const Vec3<T>& w) const {
    if constexpr (std::is_same_v<T, double>) return sigma_exact(w);
    const auto [segment, x] = locate(glm::dot(w, axis_));
    return segments_->sigma[segment].at(x);
  }
  /// int D <w.m> w'^T S w' dm: with S the matrix of A, single scattering; with I - S, multiple scattering. Never the
  /// difference of sigma and the former, which cancels.
  T shadowed_sigma(const Vec3<T>& w, const SymMat3& s) const;

  /// int w^T S w sigma(w) dw.
  T integral_sigma(const SymMat3& s) const;
  /// B(S, R) = int w^T S w shadowed_sigma(w, R) dw; symmetric and bilinear.
  T integral_shadowed(const SymMat3& s, const SymMat3& r) const;

  /// A normal with density D.
  Vec3<T> sample_normal(Rng& rng) const;
  /// A normal with density D(m) <w.m> / sigma(w). Rejection, acceptance at least 0.8 for every n and w.
  Vec3<T> sample_visible(const Vec3<T>& w, Rng& rng) const;

 private:
  struct Place {
    int segment;
    float x;
  };
  static Place locate(T t) {
    // Just below 1, so that the last segment needs no test of its own. In this order min takes NaN to a valid place
    // too.
    const float scaled = std::min(1.0f - 0x1p-24f, static_cast<float>(std::abs(t))) * LobeSegments::kCount;
    const int segment = static_cast<int>(scaled);
    return {segment, scaled - static_cast<float>(segment)};
  }
  T sigma_exact(const Vec3<T>& w) const;
  T shadowed_sigma_exact(const Vec3<T>& w, const SymMat3& s) const;

  const LobeCoefficients* coefficients_;
  const LobeSegments* segments_;
  Vec3<T> axis_;
  T sampling_power_;  ///< E[(m.axis)^2]
  int n_;
  LobeKind kind_;
};

using TrigLobe = BasicTrigLobe<float>;

template <typename T>
struct WeightedLobe {
  BasicTrigLobe<T> lobe;
  T weight;
};

/// A mixture of up to two lobes and the isotropic one (thesis 13.1.2 takes one cosine and one sine lobe). Immutable;
/// any thread.
template <typename T>
class BasicLobeMixture {
 public:
  static constexpr int kMaxLobes = 2;
  /// The isotropic distribution.
  BasicLobeMixture() = default;
  /// Weights are relative; those that are not positive and finite drop their lobe, and lobes beyond kMaxLobes are
  /// dropped. Any number of isotropic lobes (exponent 0) goes. If none is left: isotropic.
  explicit BasicLobeMixture(std::span<const WeightedLobe<T>> lobes);

  std::span<const WeightedLobe<T>> lobes() const { return {lobes_.data(), static_cast<size_t>(count_)}; }
  T isotropic_weight() const { return isotropic_; }

  /// As those of one lobe: all are linear in D.
  T ndf(const Vec3<T>& m) const {
    return sum(T(1) / (T(4) * kPiOf<T>), [&](const BasicTrigLobe<T>& lobe) { return lobe.ndf(m); });
  }
  T sigma(const Vec3<T>& w) const {
    return sum(T(0.25), [&](const BasicTrigLobe<T>& lobe) { return lobe.sigma(w); });
  }
  T shadowed_sigma(const Vec3<T>& w, const SymMat3& s) const {
    return sum(trace(s) / T(12), [&](const BasicTrigLobe<T>& lobe) { return lobe.shadowed_sigma(w, s); });
  }
  T integral_sigma(const SymMat3& s) const {
    return sum(kPiOf<T> * trace(s) / T(3), [&](const BasicTrigLobe<T>& lobe) { return lobe.integral_sigma(s); });
  }
  T integral_shadowed(const SymMat3& s, const SymMat3& r) const {
    return sum(kPiOf<T> * trace(s) * trace(r) / T(9),
               [&](const BasicTrigLobe<T>& lobe) { return lobe.integral_shadowed(s, r); });
  }
  Vec3<T> sample_normal(Rng& rng) const;
  Vec3<T> sample_visible(const Vec3<T>& w, Rng& rng) const;

 private:
  static T trace(const SymMat3& s) { return T(s.xx) + T(s.yy) + T(s.zz); }
  template <typename Value>
  T sum(T of_isotropic, const Value& value) const {
    // Absent lobes have weight 0: cheaper than asking.
    return isotropic_ * of_isotropic +
           (lobes_[0].weight * value(lobes_[0].lobe) + lobes_[1].weight * value(lobes_[1].lobe));
  }

  std::array<WeightedLobe<T>, kMaxLobes> lobes_{};
  T isotropic_ = 1;
  int count_ = 0;
};

using LobeMixture = BasicLobeMixture<float>;

}  // namespace farfield
