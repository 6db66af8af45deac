// SPDX-License-Identifier: Apache-2.0
#include "scattering/media/lobe_fit.h"

#include <limits>
#include <vector>

#include "scattering/sggx.h"

namespace farfield {
namespace {

/// Directions of one octant of the eigenframe, where everything is symmetric.
constexpr int kHeights = 32;
constexpr int kAzimuths = 16;
constexpr int kDirections = kHeights * kAzimuths;
constexpr int kExponents = kLargestLobeExponent;

using Basis = std::array<double, kDirections>;

double dot(const Basis& a, const Basis& b) {
  double sum = 0;
  for (int i = 0; i < kDirections; ++i) sum += a[i] * b[i];
  return sum;
}

/// Least squares on the basis functions in `active`, by elimination. False if they are dependent.
bool solve(const double (&gram)[3][3], const double (&right)[3], unsigned active, double (&x)[3]) {
  double a[3][4];
  int index[3], count = 0;
  for (int i = 0; i < 3; ++i) {
    x[i] = 0;
    if (active >> i & 1u) index[count++] = i;
  }
  for (int r = 0; r < count; ++r) {
    for (int c = 0; c < count; ++c) a[r][c] = gram[index[r]][index[c]];
    a[r][3] = right[index[r]];
  }
  for (int p = 0; p < count; ++p) {
    if (!(a[p][p] > 1e-12 * gram[index[p]][index[p]])) return false;
    for (int r = 0; r < count; ++r) {
      if (r == p) continue;
      const double f = a[r][p] / a[p][p];
      for (int c = p; c < count; ++c) a[r][c] -= f * a[p][c];
      a[r][3] -= f * a[p][3];
    }
  }
  for (int r = 0; r < count; ++r) x[index[r]] = a[r][3] / a[r][r];
  return true;
}

struct Solution {
  double x[3] = {0, 0, 0};
  double residual = std::numeric_limits<double>::infinity();  ///< mean squared relative error
  int cosine = 0, sine = 0;
};

/// Non-negative least squares with three unknowns: the best of the feasible subsets.
void improve(Solution& best, const double (&gram)[3][3], const double (&right)[3], int cosine, int sine) {
  for (unsigned active = 1; active < 8; ++active) {
    double x[3];
    if (!solve(gram, right, active, x) || x[0] < 0 || x[1] < 0 || x[2] < 0) continue;
    // |Bx - 1|^2 / count = 1 - x.right / count at a least-squares solution.
    double explained = 0;
    for (int i = 0; i < 3; ++i) explained += x[i] * right[i];
    const double residual = 1 - explained / kDirections;
    if (residual < best.residual) best = {{x[0], x[1], x[2]}, residual, cosine, sine};
  }
}

dvec3 eigenvector(const SymEntries& s, double eigenvalue) {
  // The rows of S - eigenvalue I span the plane across it: the largest cross product of two of them.
  const dvec3 rows[3] = {
      {s.xx - eigenvalue, s.xy, s.xz}, {s.xy, s.yy - eigenvalue, s.yz}, {s.xz, s.yz, s.zz - eigenvalue}};
  const dvec3 candidates[3] = {glm::cross(rows[0], rows[1]), glm::cross(rows[1], rows[2]),
                               glm::cross(rows[2], rows[0])};
  dvec3 best(0.0);
  for (const dvec3& c : candidates) {
    if (glm::dot(c, c) > glm::dot(best, best)) best = c;
  }
  return best;
}

/// Orthonormal; axes of eigenvalues l.x >= l.y >= l.z.
BasicFrame<double> eigenframe(const SymEntries& s, const dvec3& l) {
  // Start from the eigenvalue that stands most apart: the other two may be equal.
  const bool first_apart = l.x - l.y >= l.y - l.z;
  const dvec3 apart = eigenvector(s, first_apart ? l.x : l.z);
  const double size = glm::dot(apart, apart);
  if (!(size > 1e-24 * std::pow(l.x, 4))) return BasicFrame<double>(dvec3(0, 0, 1));
  BasicFrame<double> frame(apart / std::sqrt(size));
  // Diagonalise the 2x2 block across it.
  const auto q = [&](const dvec3& a, const dvec3& b) {
    return a.x * (s.xx * b.x + s.xy * b.y + s.xz * b.z) + a.y * (s.xy * b.x + s.yy * b.y + s.yz * b.z) +
           a.z * (s.xz * b.x + s.yz * b.y + s.zz * b.z);
  };
  const double angle = 0.5 * std::atan2(2 * q(frame.x, frame.y), q(frame.x, frame.x) - q(frame.y, frame.y));
  const dvec3 larger = std::cos(angle) * frame.x + std::sin(angle) * frame.y;
  const dvec3 smaller = glm::cross(frame.z, larger);
  const dvec3 apart_unit = frame.z;
  if (first_apart) {
    frame.x = apart_unit, frame.y = larger, frame.z = smaller;
  } else {
    frame.x = larger, frame.y = smaller, frame.z = apart_unit;
  }
  return frame;
}

}  // namespace

LobeFit fit_lobes(const SymMat3& s) {
  const SymEntries e = entries(s);
  const dvec3 l = eigenvalues(e);
  if (!(l.x > 0) || !std::isfinite(l.x)) return {};
  const BasicFrame<double> frame = eigenframe(e, l);

  // In the eigenframe: cosine lobe about x, sine lobe about z. Everything divided by sigma: relative errors.
  std::vector<Basis> cosine(kExponents), sine(kExponents);
  Basis isotropic;
  for (int i = 0; i < kDirections; ++i) {
    const double z = (i / kAzimuths + 0.5) / kHeights, turn = (i % kAzimuths + 0.5) / (4.0 * kAzimuths);
    const dvec3 w = direction_at_height(z, turn);
    const double sigma = std::sqrt(l.x * w.x * w.x + l.y * w.y * w.y + l.z * w.z * w.z);
    isotropic[i] = 0.25 / sigma;
    for (int n = 1; n <= kExponents; ++n) {
      cosine[n - 1][i] = BasicTrigLobe<double>(LobeKind::Cosine, n, dvec3(1, 0, 0)).sigma(w) / sigma;
      sine[n - 1][i] = BasicTrigLobe<double>(LobeKind::Sine, n, dvec3(0, 0, 1)).sigma(w) / sigma;
    }
  }
  Basis one;
  one.fill(1);

  Solution best;
  const double ii = dot(isotropic, isotropic), ri = dot(isotropic, one);
  for (int nc = 1; nc <= kExponents; ++nc) {
    const Basis& c = cosine[nc - 1];
    const double cc = dot(c, c), ci = dot(c, isotropic), rc = dot(c, one);
    for (int ns = 1; ns <= kExponents; ++ns) {
      const Basis& b = sine[ns - 1];
      const double cs = dot(c, b), ss = dot(b, b), si = dot(b, isotropic);
      improve(best, {{cc, cs, ci}, {cs, ss, si}, {ci, si, ii}}, {rc, dot(b, one), ri}, nc, ns);
    }
  }

  const WeightedLobe<float> lobes[] = {
      {TrigLobe(LobeKind::Cosine, best.cosine, vec3(frame.x)), static_cast<float>(best.x[0])},
      {TrigLobe(LobeKind::Sine, best.sine, vec3(frame.z)), static_cast<float>(best.x[1])},
      {TrigLobe(), static_cast<float>(best.x[2])}};
  LobeFit fit;
  fit.flakes = LobeMixture(lobes);
  fit.rho_factor = static_cast<float>(best.x[0] + best.x[1] + best.x[2]);
  fit.rms_error = static_cast<float>(std::sqrt(std::max(0.0, best.residual)));
  return fit;
}

}  // namespace farfield
