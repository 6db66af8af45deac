// SPDX-License-Identifier: Apache-2.0
#include "scattering/normal_moments.h"

#include <algorithm>
#include <cmath>

#include "scattering/carlson.h"
#include "scattering/sggx.h"

namespace farfield {
namespace {

/// Smaller shares of the largest are none: flakes that flat, or fibres that thin, are exact anyway.
constexpr double kLeastShare = 1e-9;

double rg(const dvec3& x) { return carlson_rg(x.x, x.y, x.z); }

/// Of eigenvalues; sum 1.
dvec3 moments_of(const dvec3& lambda) {
  constexpr double kStep = 1e-3;  // of ln lambda: an error of 1e-7
  dvec3 moments(0.0);
  for (int i = 0; i < 3; ++i) {
    dvec3 more = lambda, less = lambda;
    more[i] *= 1 + kStep, less[i] *= 1 - kStep;
    moments[i] = rg(more) - rg(less);
  }
  return moments / (moments.x + moments.y + moments.z);
}

/// The inverse; largest 1. Each step gets some five times nearer: moments grow a little slower than eigenvalues.
dvec3 lambda_of(const dvec3& moments) {
  constexpr double kPower = 1.25;
  constexpr int kSteps = 6;
  dvec3 lambda = glm::pow(moments, dvec3(kPower));
  for (int step = 0; step < kSteps; ++step) {
    const dvec3 is = moments_of(lambda);
    for (int i = 0; i < 3; ++i) lambda[i] = moments[i] > 0 ? lambda[i] * std::pow(moments[i] / is[i], kPower) : 0;
    lambda /= lambda.x;
  }
  return lambda;
}

/// The matrix with the eigenvectors of `s` and, for its descending eigenvalues x, the eigenvalues y: the polynomial of
/// s through these, after Newton.
SymMat3 with_eigenvalues(const SymMat3& s, const dvec3& x, const dvec3& y) {
  const double near = 1e-7 * x.x;
  const auto slope = [&](int i, int j) { return x[i] - x[j] > near ? (y[i] - y[j]) / (x[i] - x[j]) : 0.0; };
  double first = slope(0, 1), second = slope(1, 2);
  if (!(x[0] - x[1] > near)) first = second;
  if (!(x[1] - x[2] > near)) second = first;
  const double curve = x[0] - x[2] > near ? (first - second) / (x[0] - x[2]) : 0.0;
  const glm::dmat3 m(s.to_mat3()), unit(1.0);
  const glm::dmat3 result = unit * y[0] + (m - unit * x[0]) * (unit * first + (m - unit * x[1]) * curve);
  return {static_cast<float>(result[0][0]), static_cast<float>(result[1][1]), static_cast<float>(result[2][2]),
          static_cast<float>(result[1][0]), static_cast<float>(result[2][0]), static_cast<float>(result[2][1])};
}

template <typename Map>
SymMat3 map_eigenvalues(const SymMat3& s, const Map& map) {
  const dvec3 x = eigenvalues(s);
  if (!(x.x > 0)) return {};
  dvec3 shares = x / x.x;
  for (int i = 1; i < 3; ++i) shares[i] = shares[i] > kLeastShare ? shares[i] : 0;
  return with_eigenvalues(s, x, map(shares));
}

}  // namespace

SymMat3 normal_moments(const SymMat3& s) { return map_eigenvalues(s, moments_of); }

SymMat3 sggx_of_moments(const SymMat3& moments) {
  return map_eigenvalues(moments,
                         [](const dvec3& shares) { return lambda_of(shares / (shares.x + shares.y + shares.z)); });
}

}  // namespace farfield
