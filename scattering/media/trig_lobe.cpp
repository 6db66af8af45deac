// SPDX-License-Identifier: Apache-2.0
#include "scattering/media/trig_lobe.h"

#include <algorithm>
#include <cmath>

namespace farfield {
namespace {

using Polynomial = LobeCoefficients::Polynomial;

/// Taylor coefficients in t^2 of F_k(t) = 2F1(-n, -k/2; 1/2; t^2) (cosine lobe) or 2F1(-n, -k/2; 1; 1 - t^2) (sine
/// lobe): int D |m.w|^k dm = kappa_k F_k(t).
Polynomial moment_series(LobeKind kind, int n, int k) {
  Polynomial f{};
  const double half = k / 2.0;
  f[0] = 1;
  if (kind == LobeKind::Sine) {
    for (int i = 0; i < n; ++i) f[0] *= (1 + half + i) / (1 + i);
  }
  for (int j = 1; j <= n; ++j) {
    const double lower = kind == LobeKind::Cosine ? j - 0.5 : j - 1 - half - n;
    f[j] = f[j - 1] * (j - 1 - n) * (j - 1 - half) / (lower * j);
  }
  return f;
}

// Formula notes 2.2: the Hessian in w of the homogeneous function int D |m.w|^5.
LobeCoefficients make_coefficients(LobeKind kind, int n) {
  double kappa1 = 0.5;
  for (int i = 1; i <= n; ++i) kappa1 *= (2 * i + 1) / (2.0 * (i + 1));
  const double kappa3 = kappa1 / (n + 2), kappa5 = 2 * kappa3 / (n + 3);
  const Polynomial f1 = moment_series(kind, n, 1), f3 = moment_series(kind, n, 3), f5 = moment_series(kind, n, 5);

  LobeCoefficients c;
  for (int j = 0; j <= n; ++j) {
    const double a = kappa1 * f1[j] / 2, b = kappa3 * f3[j] / 2, d = kappa5 * f5[j] / 2;
    const double d_next = j < n ? kappa5 * f5[j + 1] / 2 : 0;
    c.sigma[j] = a;
    c.shadow_w[j] = a - 4.0 / 3 * (3 - 2 * j) * b + 0.2 * (5 - 2 * j) * (3 - 2 * j) * d;
    c.shadow_axis[j] = 0.2 * (2 * j + 2) * (2 * j + 1) * d_next;
    c.shadow_trace[j] = 0.2 * (5 - 2 * j) * d;
    if (j > 0) c.shadow_cross[j - 1] = -8.0 * j / 3 * b + 0.8 * j * (5 - 2 * j) * d;
  }
  double norm = 4 * kPiOf<double>;
  for (int i = 1; i <= n; ++i) norm *= kind == LobeKind::Cosine ? (2 * i - 1) / (2 * i + 1.0) : 2 * i / (2 * i + 1.0);
  c.inverse_norm = 1 / norm;
  c.blocks = n / 4 + 1;
  return c;
}

/// Horner's rule in four interleaved chains, which a processor runs side by side.
double evaluate(const Polynomial& c, int blocks, double x) {
  const double x2 = x * x, x4 = x2 * x2;
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  for (int i = 4 * (blocks - 1); i >= 0; i -= 4) {
    s0 = s0 * x4 + c[i], s1 = s1 * x4 + c[i + 1], s2 = s2 * x4 + c[i + 2], s3 = s3 * x4 + c[i + 3];
  }
  return (s0 + x * s1) + x2 * (s2 + x * s3);
}

/// The cubic through four Chebyshev nodes of segment i.
LobeSegments::Cubic make_cubic(const Polynomial& c, int blocks, int i) {
  double x[4], f[4];
  for (int k = 0; k < 4; ++k) {
    x[k] = 0.5 - 0.5 * std::cos((2 * k + 1) * kPiOf<double> / 8);
    const double t = (i + x[k]) / LobeSegments::kCount;
    f[k] = evaluate(c, blocks, t * t);
  }
  // Newton's divided differences, then expanded in powers of x.
  for (int order = 1; order < 4; ++order) {
    for (int k = 3; k >= order; --k) f[k] = (f[k] - f[k - 1]) / (x[k] - x[k - order]);
  }
  double p[4] = {f[3], 0, 0, 0};
  for (int k = 2; k >= 0; --k) {
    for (int d = 3; d > 0; --d) p[d] = p[d - 1] - x[k] * p[d];
    p[0] = f[k] - x[k] * p[0];
  }
  return {{float(p[0]), float(p[1]), float(p[2]), float(p[3])}};
}

LobeSegments make_segments(const LobeCoefficients& c) {
  LobeSegments segments;
  for (int i = 0; i < LobeSegments::kCount; ++i) {
    segments.sigma[i] = make_cubic(c.sigma, c.blocks, i);
    segments.shadow[i] = {make_cubic(c.shadow_w, c.blocks, i), make_cubic(c.shadow_axis, c.blocks, i),
                          make_cubic(c.shadow_trace, c.blocks, i), make_cubic(c.shadow_cross, c.blocks, i)};
  }
  return segments;
}

double power(double x, int n) {
  double result = 1;
  for (; n > 0; n >>= 1, x *= x) {
    if (n & 1) result *= x;
  }
  return result;
}

/// u^(1/k), u in [0, 1).
template <typename T>
T root(T u, T k) {
  return std::exp(std::log(u) / k);
}

template <typename T>
T next(Rng& rng) {
  return static_cast<T>(rng.next());
}

/// Uniform in (0, 1]: for logarithms.
template <typename T>
T next_positive(Rng& rng) {
  return T(1) - next<T>(rng);
}

template <typename T>
T squared_cosine(Rng& rng) {
  const T c = std::cos(T(2) * kPiOf<T> * next<T>(rng));
  return c * c;
}

/// Beta(1/2, b), b > 1/2: the product of Beta(1/2, 1/2) and Beta(1, b - 1/2).
template <typename T>
T sample_beta_half(T b, Rng& rng) {
  return squared_cosine<T>(rng) * (T(1) - root(next_positive<T>(rng), b - T(0.5)));
}

/// Beta(3/2, b), b > 1/2: the product of Beta(3/2, 1/2) and Beta(2, b - 1/2).
template <typename T>
T sample_beta_three_halves(T b, Rng& rng) {
  const T first = T(1) - next<T>(rng) * squared_cosine<T>(rng);
  const T k = b - T(0.5);
  const T logarithm = std::log(next_positive<T>(rng)) / k + std::log(next_positive<T>(rng)) / (k + T(1));
  return first * (T(1) - std::exp(logarithm));
}

/// Which factor the cosine to the lobe's axis is drawn with, beside D itself.
enum class Tilt { Along, Across, Plain };  // (m.axis)^2, 1 - (m.axis)^2, 1

template <typename T>
T sample_axis_cosine(LobeKind kind, int n, Tilt tilt, Rng& rng) {
  if (kind == LobeKind::Cosine) {
    const T k1 = T(2 * n + 1), k3 = T(2 * n + 3);
    const T u = next_positive<T>(rng);
    if (tilt == Tilt::Along) return root(u, k3);
    if (tilt == Tilt::Plain) return root(u, k1);
    return std::exp(std::log(u) / k1 + std::log(next_positive<T>(rng)) / k3);
  }
  const T b = T(n + 1);
  if (tilt == Tilt::Along) return std::sqrt(sample_beta_three_halves(b, rng));
  return std::sqrt(sample_beta_half(tilt == Tilt::Plain ? b : b + T(1), rng));
}

double quadratic(const SymMat3& s, const dvec3& v) {
  return double(s.xx) * v.x * v.x + double(s.yy) * v.y * v.y + double(s.zz) * v.z * v.z +
         2 * (double(s.xy) * v.x * v.y + double(s.xz) * v.x * v.z + double(s.yz) * v.y * v.z);
}

dvec3 times(const SymMat3& s, const dvec3& v) {
  return {s.xx * v.x + s.xy * v.y + s.xz * v.z, s.xy * v.x + s.yy * v.y + s.yz * v.z,
          s.xz * v.x + s.yz * v.y + s.zz * v.z};
}

double trace(const SymMat3& s) { return double(s.xx) + s.yy + s.zz; }

}  // namespace

const LobeCoefficients& lobe_coefficients(LobeKind kind, int n) {
  using Row = std::array<LobeCoefficients, kLargestLobeExponent + 1>;
  static const std::array<Row, 2> table = [] {
    std::array<Row, 2> t;
    for (int i = 0; i <= kLargestLobeExponent; ++i) {
      t[0][i] = make_coefficients(LobeKind::Cosine, i);
      t[1][i] = make_coefficients(LobeKind::Sine, i);
    }
    return t;
  }();
  return table[kind == LobeKind::Cosine ? 0 : 1][n];
}

const LobeSegments& lobe_segments(LobeKind kind, int n) {
  using Row = std::array<LobeSegments, kLargestLobeExponent + 1>;
  static const std::array<Row, 2> table = [] {
    std::array<Row, 2> t;
    for (int i = 0; i <= kLargestLobeExponent; ++i) {
      t[0][i] = make_segments(lobe_coefficients(LobeKind::Cosine, i));
      t[1][i] = make_segments(lobe_coefficients(LobeKind::Sine, i));
    }
    return t;
  }();
  return table[kind == LobeKind::Cosine ? 0 : 1][n];
}

template <typename T>
BasicTrigLobe<T>::BasicTrigLobe(LobeKind kind, int n, const Vec3<T>& axis)
    : coefficients_(nullptr), segments_(nullptr), axis_(axis), n_(std::clamp(n, 0, kLargestLobeExponent)), kind_(kind) {
  coefficients_ = &lobe_coefficients(kind_, n_);
  segments_ = &lobe_segments(kind_, n_);
  sampling_power_ = kind == LobeKind::Cosine ? T(2 * n_ + 1) / T(2 * n_ + 3) : T(1) / T(2 * n_ + 3);
}

template <typename T>
T BasicTrigLobe<T>::ndf(const Vec3<T>& m) const {
  const double c = glm::dot(m, axis_), c2 = std::min(c * c, 1.0);
  return static_cast<T>(coefficients_->inverse_norm * power(kind_ == LobeKind::Cosine ? c2 : 1 - c2, n_));
}

template <typename T>
T BasicTrigLobe<T>::sigma_exact(const Vec3<T>& w) const {
  const double t = glm::dot(w, axis_);
  return static_cast<T>(evaluate(coefficients_->sigma, coefficients_->blocks, std::min(t * t, 1.0)));
}

template <typename T>
T BasicTrigLobe<T>::shadowed_sigma(const Vec3<T>& w, const SymMat3& s) const {
  if constexpr (std::is_same_v<T, double>) return shadowed_sigma_exact(w, s);
  const T t = glm::dot(w, axis_);
  const auto [segment, x] = locate(t);
  const LobeSegments::Shadow& c = segments_->shadow[segment];
  const vec3 sw = s * vec3(w), axis(axis_);
  const float value = glm::dot(vec3(w), sw) * c.w.at(x) + s.quadratic(axis) * c.axis.at(x) + s.trace() * c.trace.at(x) +
                      static_cast<float>(t) * glm::dot(sw, axis) * c.cross.at(x);
  return std::max(0.0f, value);
}

template <typename T>
T BasicTrigLobe<T>::shadowed_sigma_exact(const Vec3<T>& w, const SymMat3& s) const {
  const LobeCoefficients& c = *coefficients_;
  const dvec3 direction(w), axis(axis_);
  const double t = glm::dot(direction, axis), t2 = std::min(t * t, 1.0);
  const dvec3 sw = times(s, direction);
  const double q_axis = quadratic(s, axis), q_trace = trace(s), q_w = glm::dot(direction, sw);
  const double value = q_w * evaluate(c.shadow_w, c.blocks, t2) + q_axis * evaluate(c.shadow_axis, c.blocks, t2) +
                       q_trace * evaluate(c.shadow_trace, c.blocks, t2) +
                       t * glm::dot(sw, axis) * evaluate(c.shadow_cross, c.blocks, t2);
  return static_cast<T>(std::max(0.0, value));
}

template <typename T>
T BasicTrigLobe<T>::integral_sigma(const SymMat3& s) const {
  const double q = quadratic(s, dvec3(axis_)), tr = trace(s), n = n_;
  const double sum =
      kind_ == LobeKind::Cosine ? (n * q + (n + 2) * tr) / (4 * n + 6) : ((3 * n + 4) * tr - n * q) / (8 * n + 12);
  return static_cast<T>(kPiOf<double> * sum);
}

template <typename T>
T BasicTrigLobe<T>::integral_shadowed(const SymMat3& s, const SymMat3& r) const {
  const dvec3 axis(axis_), s_axis = times(s, axis), r_axis = times(r, axis);
  const double n = n_, qs = glm::dot(axis, s_axis), qr = glm::dot(axis, r_axis);
  const double trs = trace(s), trr = trace(r);
  const double tr_sr = double(s.xx) * r.xx + double(s.yy) * r.yy + double(s.zz) * r.zz +
                       2 * (double(s.xy) * r.xy + double(s.xz) * r.xz + double(s.yz) * r.yz);
  const double x = glm::dot(s_axis, r_axis), mu = (qs * trr + qr * trs) / 2;
  const double rest = trs * trr - tr_sr;
  if (kind_ == LobeKind::Cosine) {
    const double sum = 15 * n * (n - 1) * qs * qr - 10 * n * (n - 2) * x + 2 * n * (n + 10) * (mu - x) +
                       (3 * n * n + 7 * n + 10) * tr_sr + (n * n + 5 * n + 10) * rest;
    return static_cast<T>(kPiOf<double> / (24 * n * n + 96 * n + 90) * sum);
  }
  const double sum = 45 * n * (n - 1) * qs * qr + 10 * n * (1 - 5 * n) * x - 2 * n * (19 * n + 25) * (mu - x) +
                     (29 * n * n + 91 * n + 80) * tr_sr + (31 * n * n + 105 * n + 80) * rest;
  return static_cast<T>(kPiOf<double> / (192 * n * n + 768 * n + 720) * sum);
}

template <typename T>
Vec3<T> BasicTrigLobe<T>::sample_normal(Rng& rng) const {
  const T c = sample_axis_cosine<T>(kind_, n_, Tilt::Plain, rng);
  const T sign = rng.next() < 0.5f ? T(-1) : T(1);
  return BasicFrame<T>(axis_).to_world(direction_at_height(sign * c, next<T>(rng)));
}

// With x = m.w, |x| <= (x^2 + c^2) / (2 c), where c^2 = E_D[x^2] makes the bound tight where D is. The density
// D(m) (x^2 + c^2) is sampled in closed form in the frame with z = axis and w = (s, 0, t): first a mixture of three
// densities without the mixed term 2 t c s sqrt(1 - c^2) cos(phi), then a choice between phi and phi + pi that
// restores it. m and -m are the same flake, so the sign of m.axis needs no choice.
template <typename T>
Vec3<T> BasicTrigLobe<T>::sample_visible(const Vec3<T>& w, Rng& rng) const {
  const T t = std::clamp(glm::dot(w, axis_), T(-1), T(1));
  const T s2 = (T(1) - t) * (T(1) + t), s = std::sqrt(s2);
  const T along = t * t * sampling_power_, across = s2 * (T(1) - sampling_power_) / T(2);
  const T c2 = along + across, bound = std::sqrt(c2);
  for (;;) {
    const T pick = next<T>(rng) * T(2) * c2;
    const Tilt tilt = pick < along ? Tilt::Along : pick < c2 ? Tilt::Across : Tilt::Plain;
    const T z = std::min(sample_axis_cosine<T>(kind_, n_, tilt, rng), T(1));
    const T phi = T(2) * kPiOf<T> * next<T>(rng);
    T cos_phi = std::cos(phi), sin_phi = std::sin(phi);
    if (tilt == Tilt::Across && next<T>(rng) > cos_phi * cos_phi) std::swap(cos_phi, sin_phi);
    const T r = std::sqrt((T(1) - z) * (T(1) + z));
    const T a = t * z;
    T b = s * r * cos_phi;
    if (next<T>(rng) * T(2) * (a * a + b * b + c2) < (a - b) * (a - b) + c2)
      b = -b, cos_phi = -cos_phi, sin_phi = -sin_phi;
    const T x = a + b;
    if (next<T>(rng) * (x * x + c2) > T(2) * bound * std::abs(x)) continue;

    const Vec3<T> across_axis = w - t * axis_;
    const T length2 = glm::dot(across_axis, across_axis);
    // At w = +-axis every azimuth is the same.
    const Vec3<T> frame_x = length2 > T(1e-12) ? across_axis / std::sqrt(length2) : BasicFrame<T>(axis_).x;
    const Vec3<T> frame_y = glm::cross(axis_, frame_x);
    const Vec3<T> m = r * (cos_phi * frame_x + sin_phi * frame_y) + z * axis_;
    return x < 0 ? -m : m;
  }
}

template class BasicTrigLobe<float>;
template class BasicTrigLobe<double>;

template <typename T>
BasicLobeMixture<T>::BasicLobeMixture(std::span<const WeightedLobe<T>> lobes) : isotropic_(0) {
  T total = 0;
  for (const WeightedLobe<T>& lobe : lobes) {
    const bool is_isotropic = lobe.lobe.exponent() == 0;
    if (!(lobe.weight > 0) || !std::isfinite(lobe.weight) || (!is_isotropic && count_ == kMaxLobes)) continue;
    total += lobe.weight;
    if (is_isotropic) {
      isotropic_ += lobe.weight;
    } else {
      lobes_[count_++] = lobe;
    }
  }
  if (!(total > 0)) {
    isotropic_ = 1;
    return;
  }
  isotropic_ /= total;
  for (int i = 0; i < count_; ++i) lobes_[i].weight /= total;
}

template <typename T>
Vec3<T> BasicLobeMixture<T>::sample_normal(Rng& rng) const {
  T pick = next<T>(rng);
  for (int i = 0; i < count_; ++i) {
    if (pick < lobes_[i].weight || (i + 1 == count_ && isotropic_ == 0)) return lobes_[i].lobe.sample_normal(rng);
    pick -= lobes_[i].weight;
  }
  return uniform_sphere(next<T>(rng), next<T>(rng));
}

template <typename T>
Vec3<T> BasicLobeMixture<T>::sample_visible(const Vec3<T>& w, Rng& rng) const {
  T visible[kMaxLobes], total = isotropic_ / T(4);
  for (int i = 0; i < count_; ++i) total += visible[i] = lobes_[i].weight * lobes_[i].lobe.sigma(w);
  T pick = next<T>(rng) * total;
  for (int i = 0; i < count_; ++i) {
    if (pick < visible[i] || (i + 1 == count_ && isotropic_ == 0)) return lobes_[i].lobe.sample_visible(w, rng);
    pick -= visible[i];
  }
  return cosine_lobe(w, next<T>(rng), next<T>(rng));
}

template class BasicLobeMixture<float>;
template class BasicLobeMixture<double>;

}  // namespace farfield
