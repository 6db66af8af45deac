// SPDX-License-Identifier: Apache-2.0
// Newton on -log f(rho) = tau, with f(rho) = mean over directions of exp(-rho sigma(w) L). -log f is increasing and
// concave, so from the Jensen bound tau / (mean sigma L) the iterates rise to the root and never pass it: no bracket
// and no line search. The discretised f is a sum of exponentials too, so this holds exactly for what is computed.
#include "prefilter/density.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/check.h"
#include "scattering/sggx.h"

namespace farfield {
namespace {

/// Gauss-Legendre nodes and weights on (0, 1).
struct GaussLegendre {
  std::vector<double> node, weight;

  explicit GaussLegendre(int n) : node(static_cast<size_t>(n)), weight(static_cast<size_t>(n)) {
    for (int i = 0; i < n; ++i) {
      double x = std::cos(M_PI * (i + 0.75) / (n + 0.5)), slope = 1;
      for (int step = 0; step < 100; ++step) {  // Newton on the Legendre polynomial: converges in 4 or 5 steps
        double p = 1, previous = 0;
        for (int k = 1; k <= n; ++k) {
          const double next = ((2 * k - 1) * x * p - (k - 1) * previous) / k;
          previous = p;
          p = next;
        }
        slope = n * (x * p - previous) / (x * x - 1);
        const double change = p / slope;
        x -= change;
        if (std::abs(change) < 1e-15) break;
      }
      node[static_cast<size_t>(i)] = 0.5 * (1 + x);
      weight[static_cast<size_t>(i)] = 1 / ((1 - x * x) * slope * slope);
    }
  }
};

/// Directions of one octant in the eigenframe and their weights (sum 1). Pole at the largest eigenvalue. The cubes
/// (z = u^3, phi = pi/2 (1 - v^3)) crowd the nodes where sigma vanishes for a singular S (docs/theory.md, section 7.3).
struct Octant {
  std::vector<double> z2, y2, x2;  ///< squared components along the largest, middle and smallest axis
  std::vector<double> weight;

  explicit Octant(int n) {
    const GaussLegendre rule(n);
    for (size_t i = 0; i < rule.node.size(); ++i) {
      for (size_t j = 0; j < rule.node.size(); ++j) {
        const double u = rule.node[i], v = rule.node[j];
        const double z = u * u * u, cosine = std::cos(0.5 * M_PI * (1 - v * v * v));
        z2.push_back(z * z);
        y2.push_back((1 - z * z) * cosine * cosine);
        x2.push_back((1 - z * z) * (1 - cosine * cosine));
        weight.push_back(rule.weight[i] * 3 * u * u * rule.weight[j] * 3 * v * v);
      }
    }
    double sum = 0;
    for (const double w : weight) sum += w;
    for (double& w : weight) w /= sum;
  }
};

constexpr int kMaxNodes = 16 * 16;

/// sigma(w) / sqrt(lambda_max) at the nodes of a rule.
struct Sigmas {
  const Octant* octant;
  std::array<double, kMaxNodes> sigma;
  double mean = 0;

  Sigmas(const dvec3& eigenvalue, const Octant& rule) : octant(&rule) {
    const double middle = eigenvalue.y / eigenvalue.x, smallest = eigenvalue.z / eigenvalue.x;
    for (size_t i = 0; i < rule.weight.size(); ++i) {
      sigma[i] = std::sqrt(rule.z2[i] + middle * rule.y2[i] + smallest * rule.x2[i]);
      mean += rule.weight[i] * sigma[i];
    }
  }
};

/// f - 1 and df/dx for x = rho sqrt(lambda_max) L.
struct Transmittance {
  double minus_one = 0;
  double slope = 0;
};

Transmittance transmittance(const Sigmas& s, double x) {
  Transmittance result;
  for (size_t i = 0; i < s.octant->weight.size(); ++i) {
    const double e = std::expm1(-x * s.sigma[i]), w = s.octant->weight[i];
    result.minus_one += w * e;
    result.slope -= w * s.sigma[i] * (e + 1);
  }
  return result;
}

/// A thin medium needs few nodes: exp(-x sigma) is then nearly linear in sigma.
const Octant& octant_for(double optical_depth) {
  static const Octant thin(6), medium(10), thick(16);
  return optical_depth < 0.3 ? thin : optical_depth < 1.5 ? medium : thick;
}

}  // namespace

double optical_depth_of_hits(uint32_t hits, uint32_t rays) {
  FARFIELD_ASSERT(rays > 0 && hits <= rays);
  const double counted = std::min<double>(hits, rays - 0.5);
  return -std::log1p(-counted / rays);
}

double mean_opacity(const SymMat3& s, double density, double length) {
  const dvec3 eigenvalue = eigenvalues(s);
  const double x = density * length * std::sqrt(eigenvalue.x);
  if (!(x > 0)) return 0;
  return -transmittance(Sigmas(eigenvalue, octant_for(1e9)), x).minus_one;
}

double solve_density(const SymMat3& s, double optical_depth, double length) {
  const dvec3 eigenvalue = eigenvalues(s);
  if (!(optical_depth > 0) || !(eigenvalue.x > 0)) return 0;
  const Sigmas sigmas(eigenvalue, octant_for(optical_depth));
  double x = optical_depth / sigmas.mean;
  for (int step = 0; step < 20 && x < kMaxDensityLength; ++step) {
    const Transmittance f = transmittance(sigmas, x);
    const double missing = optical_depth + std::log1p(f.minus_one);  // tau - (-log f)
    const double change = -missing * (1 + f.minus_one) / f.slope;
    x += change;
    if (std::abs(change) < 1e-7 * x) break;
  }
  return std::min(x, kMaxDensityLength) / (length * std::sqrt(eigenvalue.x));
}

}  // namespace farfield
