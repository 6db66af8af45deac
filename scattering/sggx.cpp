// SPDX-License-Identifier: Apache-2.0
#include "scattering/sggx.h"

namespace farfield {
namespace {

// The tangent bound |x| <= (x^2 + c^2) / (2 c), c^2 = tr(S) / 3, turns the density sigma into a mixture of the uniform
// and three cos^2 lobes, one per row (or column) of the factor: docs/theory.md, section 4. `project` is w -> B^T w or w
// -> B w, `axes` its rows.
template <typename T, typename Project>
Vec3<T> sample_length_of(const Vec3<T> (&axes)[3], const Project& project, Rng& rng) {
  const T a0 = glm::dot(axes[0], axes[0]), a1 = glm::dot(axes[1], axes[1]), a2 = glm::dot(axes[2], axes[2]);
  const T trace = a0 + a1 + a2;
  const T c2 = trace / T(3);
  for (;;) {
    Vec3<T> w;
    if (rng.next() < 0.5f) {
      w = uniform_sphere(T(rng.next()), T(rng.next()));
    } else {
      const T pick = T(rng.next()) * trace;
      const int row = pick < a0 ? 0 : pick < a0 + a1 ? 1 : 2;
      const T u = T(1) - T(2) * T(rng.next());
      const T z = std::copysign(std::cbrt(std::abs(u)), u);
      w = BasicFrame<T>(glm::normalize(axes[row])).to_world(direction_at_height(z, T(rng.next())));
    }
    const Vec3<T> x = project(w);
    const T q = glm::dot(x, x);
    if (T(rng.next()) * (q + c2) <= T(2) * std::sqrt(c2 * q)) return w;
  }
}

}  // namespace

SymEntries entries(const SymMat3& s) { return {s.xx, s.yy, s.zz, s.xy, s.xz, s.yz}; }

SymEntries entries_from_axes(const dvec3& eigenvalues, const dvec3& x, const dvec3& y, const dvec3& z) {
  const auto sum = [&](int i, int j) {
    return eigenvalues.x * x[i] * x[j] + eigenvalues.y * y[i] * y[j] + eigenvalues.z * z[i] * z[j];
  };
  return {sum(0, 0), sum(1, 1), sum(2, 2), sum(0, 1), sum(0, 2), sum(1, 2)};
}

template <typename T>
CholeskyFactor<T> cholesky(const SymEntries& s) {
  const double trace = s.xx + s.yy + s.zz;
  const bool finite = std::isfinite(trace) && std::isfinite(s.xy + s.xz + s.yz);
  if (!finite || !(trace > 0)) return {};
  const double floor = kSggxPivotFloor * trace;
  const double xx = std::sqrt(std::max(s.xx, floor));
  const double yx = s.xy / xx;
  const double zx = s.xz / xx;
  const double yy = std::sqrt(std::max(s.yy - yx * yx, floor));
  const double zy = (s.yz - yx * zx) / yy;
  const double zz = std::sqrt(std::max(s.zz - zx * zx - zy * zy, floor));
  return {T(xx), T(yx), T(yy), T(zx), T(zy), T(zz)};
}
template CholeskyFactor<float> cholesky<float>(const SymEntries&);
template CholeskyFactor<double> cholesky<double>(const SymEntries&);

template <typename T>
Vec3<T> BasicSggx<T>::sample_sigma(Rng& rng) const {
  const Vec3<T> columns[3] = {{b_.xx, b_.yx, b_.zx}, {0, b_.yy, b_.zy}, {0, 0, b_.zz}};
  return sample_length_of(
      columns, [this](const Vec3<T>& w) { return b_.transposed_times(w); }, rng);
}

template <typename T>
Vec3<T> BasicSggx<T>::sample_normal(Rng& rng) const {
  const Vec3<T> rows[3] = {{b_.xx, 0, 0}, {b_.yx, b_.yy, 0}, {b_.zx, b_.zy, b_.zz}};
  const Vec3<T> n = sample_length_of(
      rows, [this](const Vec3<T>& v) { return b_ * v; }, rng);
  return glm::normalize(b_ * n);
}

template class BasicSggx<float>;
template class BasicSggx<double>;

dvec3 eigenvalues(const SymEntries& s) {
  // Trigonometric solution of the characteristic polynomial, on the traceless part scaled to unit size.
  const double mean = (s.xx + s.yy + s.zz) / 3;
  const double a = s.xx - mean, b = s.yy - mean, c = s.zz - mean;
  const double size2 = (a * a + b * b + c * c + 2 * (s.xy * s.xy + s.xz * s.xz + s.yz * s.yz)) / 6;
  if (!(size2 > 0)) return dvec3(std::max(mean, 0.0));
  const double size = std::sqrt(size2);
  const double det = a * (b * c - s.yz * s.yz) - s.xy * (s.xy * c - s.yz * s.xz) + s.xz * (s.xy * s.yz - b * s.xz);
  const double phi = std::acos(std::clamp(det / (2 * size * size2), -1.0, 1.0)) / 3;
  const double largest = mean + 2 * size * std::cos(phi);
  const double smallest = mean + 2 * size * std::cos(phi + 2 * kPiOf<double> / 3);
  const double middle = 3 * mean - largest - smallest;
  return glm::max(dvec3(largest, middle, smallest), dvec3(0.0));
}

dvec3 eigenvalues(const SymMat3& s) { return eigenvalues(entries(s)); }

NormalisedSggx normalise_sggx(const SymMat3& s) {
  const double largest = eigenvalues(s).x;
  if (!(largest > 0)) return {s, 0.0f};
  return {s * static_cast<float>(1 / largest), static_cast<float>(std::sqrt(largest))};
}

}  // namespace farfield
