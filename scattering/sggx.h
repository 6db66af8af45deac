// SPDX-License-Identifier: Apache-2.0
// SGGX distributions of normals [Heitz et al. 2015], by their Cholesky factor S = B B^T: no determinant, no inverse and
// no eigenvectors of S, so that needles and flat flakes stay exact in float (docs/theory.md, sections 4 and 10.1).
// Scaling and directions: scattering/convention.h.
#pragma once

#include "base/random.h"
#include "scattering/convention.h"
#include "scattering/sym_mat3.h"
#include "scattering/warp.h"

namespace farfield {

/// Pivots of S = B B^T are raised to this times tr(S): flat flakes get a spread of normals of about 3e-5 rad instead of
/// infinite densities. A matrix held in floats carries no information below 1e-7 anyway.
inline constexpr double kSggxPivotFloor = 1e-9;

/// The lower triangular B of S = B B^T.
template <typename T>
struct CholeskyFactor {
  T xx = 0, yx = 0, yy = 0, zx = 0, zy = 0, zz = 0;

  /// B v.
  Vec3<T> operator*(const Vec3<T>& v) const { return {xx * v.x, yx * v.x + yy * v.y, zx * v.x + zy * v.y + zz * v.z}; }
  /// B^T w; its length is sigma(w) = sqrt(w^T S w).
  Vec3<T> transposed_times(const Vec3<T>& w) const {
    return {xx * w.x + yx * w.y + zx * w.z, yy * w.y + zy * w.z, zz * w.z};
  }
  /// B^-1 m. Needs positive pivots.
  Vec3<T> solve(const Vec3<T>& m) const {
    const T x = m.x / xx;
    const T y = (m.y - yx * x) / yy;
    return {x, y, (m.z - zx * x - zy * y) / zz};
  }
  T determinant() const { return xx * yy * zz; }
  T trace_of_s() const { return xx * xx + yx * yx + yy * yy + zx * zx + zy * zy + zz * zz; }
  CholeskyFactor scaled(T f) const { return {xx * f, yx * f, yy * f, zx * f, zy * f, zz * f}; }
};

/// The six entries of a symmetric matrix in double: what the factor is computed from.
struct SymEntries {
  double xx, yy, zz, xy, xz, yz;
};
SymEntries entries(const SymMat3& s);
/// sum of eigenvalue_i axis_i axis_i^T; axes orthonormal.
SymEntries entries_from_axes(const dvec3& eigenvalues, const dvec3& x, const dvec3& y, const dvec3& z);

/// Factors in double, whatever T is. Pivots are floored at kSggxPivotFloor tr(S), so that every finite S with a
/// positive trace, even an indefinite one, gives a finite factor with positive pivots. S = 0, a negative trace, NaN or
/// infinity give the zero factor: sigma = 0 everywhere.
template <typename T>
CholeskyFactor<T> cholesky(const SymEntries& s);
template <typename T = float>
CholeskyFactor<T> cholesky(const SymMat3& s) {
  return cholesky<T>(entries(s));
}

/// An SGGX distribution. Immutable; any thread. Evaluating D or sampling needs S != 0 (is_empty() tells).
template <typename T>
class BasicSggx {
 public:
  explicit BasicSggx(const CholeskyFactor<T>& factor) : b_(factor) {}
  explicit BasicSggx(const SymMat3& s) : b_(cholesky<T>(s)) {}

  const CholeskyFactor<T>& factor() const { return b_; }
  bool is_empty() const { return !(b_.xx > 0); }

  /// sqrt(w^T S w): projected area of the flakes, attenuation per rho.
  T sigma(const Vec3<T>& w) const { return glm::length(b_.transposed_times(w)); }

  /// Density of normals over the whole sphere; integral 4 R_G [Heitz et al. 2015, eq. 10]. m is unit, or 0, which gives
  /// 0.
  T ndf(const Vec3<T>& m) const {
    const Vec3<T> u = b_.solve(m);
    const T u2 = glm::dot(u, u);
    return u2 > 0 ? T(1) / (kPiOf<T> * b_.determinant() * u2 * u2) : T(0);
  }

  /// Density of sample_visible: D(m) <wo.m> / sigma(wo).
  T visible_pdf(const Vec3<T>& wo, const Vec3<T>& m) const {
    const T c = glm::dot(wo, m);
    return c > 0 ? ndf(m) * c / sigma(wo) : T(0);
  }

  /// A normal that is visible from wo. The map N -> BN/|BN| takes the unit sphere's visible normals, a cosine lobe
  /// about B^T wo, to those of the ellipsoid.
  Vec3<T> sample_visible(const Vec3<T>& wo, T u1, T u2) const {
    const Vec3<T> w = b_.transposed_times(wo);
    return glm::normalize(b_ * cosine_lobe(glm::normalize(w), u1, u2));
  }

  /// Specular phase function D(h) / (4 sigma(wo)); also its sampling density [Heitz et al. 2015, eq. 15].
  T specular_phase(const Vec3<T>& wo, const Vec3<T>& wi) const { return ndf(half_vector(wo, wi)) / (T(4) * sigma(wo)); }
  Vec3<T> sample_specular(const Vec3<T>& wo, T u1, T u2) const { return reflect_about(wo, sample_visible(wo, u1, u2)); }

  /// Diffuse phase function, E over visible m of <wi.m> / pi, which has no closed form: a one-sample estimate.
  T diffuse_phase(const Vec3<T>& wo, const Vec3<T>& wi, T u1, T u2) const {
    return std::max(T(0), glm::dot(wi, sample_visible(wo, u1, u2))) / kPiOf<T>;
  }
  /// Distributed exactly as the diffuse phase function. (u1, u2) pick the flake, (u3, u4) the direction.
  Vec3<T> sample_diffuse(const Vec3<T>& wo, T u1, T u2, T u3, T u4) const {
    return cosine_lobe(sample_visible(wo, u1, u2), u3, u4);
  }

  /// A direction with density sigma(w) / (4 pi R_G): the multiple-scattering phase function of the medium with
  /// self-shadowing (thesis 13.3.2). Rejection, acceptance at least 0.866.
  Vec3<T> sample_sigma(Rng& rng) const;
  /// A normal with density D / (4 R_G). Rejection, acceptance at least 0.866.
  Vec3<T> sample_normal(Rng& rng) const;

 private:
  CholeskyFactor<T> b_;
};

using Sggx = BasicSggx<float>;

/// The three eigenvalues, descending. Negative ones from rounding are clamped to 0.
dvec3 eigenvalues(const SymMat3& s);
dvec3 eigenvalues(const SymEntries& s);

/// S / lambda_max(S), and the factor sqrt(lambda_max) by which rho grows. S = 0 is returned as it is, with factor 0.
struct NormalisedSggx {
  SymMat3 sggx;
  float rho_factor;
};
NormalisedSggx normalise_sggx(const SymMat3& s);

}  // namespace farfield
