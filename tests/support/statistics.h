// SPDX-License-Identifier: Apache-2.0
// Quadrature over the sphere, chi-square tests, and the inputs that the tests of this room share.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/random.h"
#include "scattering/convention.h"
#include "scattering/sym_mat3.h"

namespace farfield::test {

/// Nodes and weights of Gauss-Legendre quadrature on [lower, upper].
struct Rule {
  std::vector<double> nodes, weights;
};
Rule gauss_legendre(int count, double lower = -1, double upper = 1);

/// The integral of f over the unit sphere: Gauss-Legendre in the cosine about `axis` (split at the equator, where
/// clamped cosines have their kink), trapezoid in the azimuth. Exact for polynomials up to 2 count - 1.
double integrate_sphere(const std::function<double(const dvec3&)>& f, int count, const dvec3& axis = {0, 0, 1});

/// The integral of f over the sphere in polar coordinates about `axis`, graded towards both poles and the equator, for
/// integrands with peaks there: Gauss-Legendre panels that shrink geometrically.
double integrate_sphere_graded(const std::function<double(const dvec3&)>& f, int azimuths, const dvec3& axis);

/// Chi-square test of `sample` against `density` (per steradian) on a grid of `bins` x 2 `bins` cells of equal solid
/// angle. A sample of length 0 has failed and is counted in a cell of its own, which expects what the density leaves to
/// 1. Cells that expect fewer than 5 are pooled.
struct ChiSquareOptions {
  int samples = 200000;
  int bins = 16;
  int nodes_per_bin = 8;  ///< Gauss-Legendre nodes per side of a cell
  uint64_t seed = 1;
  dvec3 axis{0, 0, 1};
};
/// The probability that a right sampler deviates at least this much.
double chi_square_p_value(const std::function<dvec3(Rng&)>& sample, const std::function<double(const dvec3&)>& density,
                          const ChiSquareOptions& options = {});

/// Every chi-square test of this room passes if its p-value is above this: 1 % over all tests of the program together
/// (Bonferroni; there are fewer than 1000 of them).
inline constexpr double kSignificance = 0.01 / 1000;

/// The mean of what draw(rng) returns (a vec3 or dvec3), per component, and its standard error.
struct Mean {
  dvec3 value{0.0};
  dvec3 standard_error{0.0};
};
template <typename Draw>
Mean mean_of(int count, uint64_t seed, const Draw& draw) {
  Rng rng(seed);
  dvec3 sum(0.0), sum2(0.0);
  for (int i = 0; i < count; ++i) {
    const dvec3 v(draw(rng));
    sum += v, sum2 += v * v;
  }
  const dvec3 mean = sum / double(count);
  return {mean, glm::sqrt(glm::max(sum2 / double(count) - mean * mean, dvec3(0.0)) / double(count))};
}

/// Matrices that every function of an SGGX meets: isotropic, flat, needles, in between, tilted, of all scales.
struct NamedSggx {
  std::string name;
  SymMat3 sggx;
};
const std::vector<NamedSggx>& sample_sggx();

SymMat3 sggx_from(const dvec3& eigenvalues, const dvec3& axis_of_first);
dvec3 random_direction(Rng& rng);

}  // namespace farfield::test
