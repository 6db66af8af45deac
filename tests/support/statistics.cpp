// SPDX-License-Identifier: Apache-2.0
#include "tests/support/statistics.h"

#include <algorithm>
#include <cmath>

#include "scattering/sggx.h"
#include "scattering/warp.h"

namespace farfield::test {
namespace {

constexpr double kTwoPi = 2 * kPiOf<double>;

/// The chance of a chi-square variable above x: the regularised incomplete gamma function Q(k/2, x/2).
double chi_square_tail(double x, double degrees) {
  const double a = degrees / 2, y = x / 2;
  if (!(y > 0)) return 1;
  const double front = std::exp(a * std::log(y) - y - std::lgamma(a));
  if (y < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 10000 && term > sum * 1e-15; ++n) sum += term *= y / (a + n);
    return 1 - front * sum;
  }
  // Lentz's continued fraction.
  double b = y + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int n = 1; n < 10000; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    h *= d * c;
    if (std::abs(d * c - 1) < 1e-15) break;
  }
  return front * h;
}

dvec3 around(const BasicFrame<double>& frame, double z, double phi) {
  return frame.to_world(direction_at_height(std::clamp(z, -1.0, 1.0), phi / kTwoPi));
}

}  // namespace

Rule gauss_legendre(int count, double lower, double upper) {
  Rule rule;
  for (int i = 0; i < count; ++i) {
    double x = std::cos(kPiOf<double> * (i + 0.75) / (count + 0.5)), slope = 1;
    for (int step = 0; step < 50; ++step) {
      double p0 = 1, p1 = x;
      for (int k = 2; k <= count; ++k) {
        const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
        p0 = p1, p1 = p2;
      }
      slope = count * (x * p1 - p0) / (x * x - 1);
      const double dx = p1 / slope;
      x -= dx;
      if (std::abs(dx) < 1e-16) break;
    }
    rule.nodes.push_back(lower + (upper - lower) * (x + 1) / 2);
    rule.weights.push_back((upper - lower) / ((1 - x * x) * slope * slope));
  }
  return rule;
}

double integrate_sphere(const std::function<double(const dvec3&)>& f, int count, const dvec3& axis) {
  const BasicFrame<double> frame(axis);
  const Rule rule = gauss_legendre(count, 0, 1);
  const int azimuths = 4 * count;
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    double ring = 0;
    for (int j = 0; j < azimuths; ++j) {
      const double phi = kTwoPi * (j + 0.5) / azimuths;
      ring += f(around(frame, rule.nodes[i], phi)) + f(around(frame, -rule.nodes[i], phi));
    }
    sum += rule.weights[i] * ring * kTwoPi / azimuths;
  }
  return sum;
}

double integrate_sphere_graded(const std::function<double(const dvec3&)>& f, int azimuths, const dvec3& axis) {
  const BasicFrame<double> frame(axis);
  const Rule rule = gauss_legendre(16, 0, 1);
  // Polar angle from the pole or from the equator, in panels that halve down to 1e-7 of a quarter turn.
  const auto integrate_from = [&](double start, double direction) {
    double sum = 0;
    const double span = kPiOf<double> / 4;
    for (int panel = 0; panel < 24; ++panel) {
      const double upper = span * std::exp2(-panel), lower = panel == 23 ? 0 : upper / 2;
      for (size_t i = 0; i < rule.nodes.size(); ++i) {
        const double theta = start + direction * (lower + (upper - lower) * rule.nodes[i]);
        const double sine = std::sin(theta), cosine = std::cos(theta);
        double ring = 0;
        for (int j = 0; j < azimuths; ++j) {
          const double phi = kTwoPi * (j + 0.5) / azimuths;
          ring += f(frame.to_world(dvec3(sine * std::cos(phi), sine * std::sin(phi), cosine)));
        }
        sum += rule.weights[i] * (upper - lower) * sine * ring * kTwoPi / azimuths;
      }
    }
    return sum;
  };
  const double pi = kPiOf<double>;
  return integrate_from(0, 1) + integrate_from(pi / 2, -1) + integrate_from(pi / 2, 1) + integrate_from(pi, -1);
}

double chi_square_p_value(const std::function<dvec3(Rng&)>& sample, const std::function<double(const dvec3&)>& density,
                          const ChiSquareOptions& options) {
  const BasicFrame<double> frame(options.axis);
  const int rows = options.bins, columns = 2 * options.bins, cells = rows * columns;
  std::vector<double> observed(cells + 1), expected(cells + 1);

  Rng rng(options.seed);
  for (int i = 0; i < options.samples; ++i) {
    const dvec3 w = sample(rng);
    if (glm::dot(w, w) == 0) {
      ++observed[cells];
      continue;
    }
    const dvec3 local = frame.to_local(w);
    const double turn = std::atan2(local.y, local.x) / kTwoPi;
    const int row = std::clamp(static_cast<int>((local.z + 1) / 2 * rows), 0, rows - 1);
    const int column = std::clamp(static_cast<int>((turn < 0 ? turn + 1 : turn) * columns), 0, columns - 1);
    ++observed[row * columns + column];
  }

  const Rule rule = gauss_legendre(options.nodes_per_bin, 0, 1);
  double total = 0;
  for (int cell = 0; cell < cells; ++cell) {
    const int row = cell / columns, column = cell % columns;
    double mean = 0;
    for (int i = 0; i < options.nodes_per_bin; ++i) {
      for (int j = 0; j < options.nodes_per_bin; ++j) {
        const double z = 2 * (row + rule.nodes[i]) / rows - 1;
        mean +=
            rule.weights[i] * rule.weights[j] * density(around(frame, z, kTwoPi * (column + rule.nodes[j]) / columns));
      }
    }
    expected[cell] = mean * 2 * kTwoPi / cells * options.samples;
    total += expected[cell];
  }
  expected[cells] = std::max(0.0, options.samples - total);

  double chi2 = 0, pooled_observed = 0, pooled_expected = 0;
  int terms = 0;
  for (int cell = 0; cell <= cells; ++cell) {
    if (expected[cell] < 5) {
      pooled_observed += observed[cell], pooled_expected += expected[cell];
      continue;
    }
    const double d = observed[cell] - expected[cell];
    chi2 += d * d / expected[cell], ++terms;
  }
  if (pooled_observed > 0 || pooled_expected >= 5) {
    const double d = pooled_observed - pooled_expected;
    // A few samples where next to nothing is expected: compare with the Poisson scale of at least 5.
    chi2 += d * d / std::max(5.0, pooled_expected), ++terms;
  }
  return terms > 1 ? chi_square_tail(chi2, terms - 1) : 1;
}

SymMat3 sggx_from(const dvec3& eigenvalues, const dvec3& axis_of_first) {
  const BasicFrame<double> frame(glm::normalize(axis_of_first));
  const SymEntries e = entries_from_axes(eigenvalues, frame.z, frame.x, frame.y);
  return {float(e.xx), float(e.yy), float(e.zz), float(e.xy), float(e.xz), float(e.yz)};
}

const std::vector<NamedSggx>& sample_sggx() {
  static const std::vector<NamedSggx> all = {
      {"isotropic", SymMat3::identity()},
      {"isotropic, tiny", SymMat3::identity() * 1e-12f},
      {"flat, on an axis", SymMat3::outer({0, 0, 1})},
      {"flat, tilted", SymMat3::outer(glm::normalize(vec3(1, -2, 0.5f)))},
      {"nearly flat", sggx_from({1, 1e-2, 1e-2}, {0.3, 0.4, -1})},
      {"fibre", sggx_from({1e-4, 1, 1}, {1, 1, 0.2})},
      {"fibre, rank 2", sggx_from({0, 1, 1}, {-0.4, 0.1, 0.9})},
      {"three different", sggx_from({1, 0.4, 0.1}, {0.2, -0.7, 0.3})},
      {"three different, huge", sggx_from({1e8, 2e7, 1e6}, {1, 0.1, 0.1})},
      {"third of identity", SymMat3::identity() * (1.0f / 3)},
  };
  return all;
}

dvec3 random_direction(Rng& rng) { return uniform_sphere(double(rng.next()), double(rng.next())); }

}  // namespace farfield::test
