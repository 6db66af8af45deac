// SPDX-License-Identifier: Apache-2.0
// [Loubet 2018, 8.2.2]; docs/theory.md, section 6.2. Points on the collapsed surface are weight * x + rest, so with
// fixed pairs of points the best x is a weighted mean; then the pairs are found anew. Both half steps lower the sum.
#include "prefilter/vertex_placement.h"

#include <algorithm>
#include <limits>

namespace farfield {

namespace {

constexpr int kMaxIterations = 64;  ///< the thesis allows 200 and needs 7 on average

double squared(const dvec3& v) { return glm::dot(v, v); }

/// Parameter in [0, 1] of the point of segment ab that is nearest to p.
double closest_on_segment(const dvec3& p, const dvec3& a, const dvec3& b) {
  const double length2 = squared(b - a);
  return length2 > 0 ? std::clamp(glm::dot(p - a, b - a) / length2, 0.0, 1.0) : 0.0;
}

dvec3 closest_on_longest_edge(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
  const double ab = squared(b - a), bc = squared(c - b), ca = squared(a - c);
  if (ab >= bc && ab >= ca) {
    const double t = closest_on_segment(p, a, b);
    return {1 - t, t, 0};
  }
  if (bc >= ca) {
    const double t = closest_on_segment(p, b, c);
    return {0, 1 - t, t};
  }
  const double t = closest_on_segment(p, c, a);
  return {t, 0, 1 - t};
}

/// Sums up weight * x + rest = target over all pairs of points.
struct LeastSquares {
  double weight2 = 0;
  dvec3 moment{0.0};
  double max_distance2 = 0;

  void add(double weight, const dvec3& rest, const dvec3& target) {
    weight2 += weight * weight;
    moment += weight * (target - rest);
  }
  std::optional<dvec3> solution() const {
    if (!(weight2 > 0)) return std::nullopt;
    return moment / weight2;
  }
};

/// Pairs p with the nearest point of the surface after the collapse.
void pair_with_after(const CollapseRing& ring, const dvec3& x, const dvec3& p, LeastSquares& sums) {
  double nearest2 = std::numeric_limits<double>::infinity();
  double weight = 0;
  dvec3 rest(0.0);
  for (const auto& [q, s] : ring.after) {
    const dvec3 bary = closest_barycentric(p, x, q, s);
    const dvec3 others = bary.y * q + bary.z * s;
    const double distance2 = squared(bary.x * x + others - p);
    if (distance2 < nearest2) nearest2 = distance2, weight = bary.x, rest = others;
  }
  sums.max_distance2 = std::max(sums.max_distance2, nearest2);
  sums.add(weight, rest, p);
}

/// Pairs the point weight * x + rest of the surface after with the nearest point of the surface before.
void pair_with_before(const CollapseRing& ring, const dvec3& x, double weight, const dvec3& rest, LeastSquares& sums) {
  const dvec3 p = weight * x + rest;
  double nearest2 = std::numeric_limits<double>::infinity();
  dvec3 nearest = p;
  for (const auto& [a, b, c] : ring.before) {
    const dvec3 bary = closest_barycentric(p, a, b, c);
    const dvec3 candidate = bary.x * a + bary.y * b + bary.z * c;
    const double distance2 = squared(candidate - p);
    if (distance2 < nearest2) nearest2 = distance2, nearest = candidate;
  }
  sums.max_distance2 = std::max(sums.max_distance2, nearest2);
  sums.add(weight, rest, nearest);
}

LeastSquares pair_closest_points(const CollapseRing& ring, const dvec3& x) {
  LeastSquares sums;
  for (const dvec3& p : ring.samples_before) pair_with_after(ring, x, p, sums);
  pair_with_before(ring, x, 1.0, dvec3(0.0), sums);
  for (const dvec3& neighbour : ring.neighbours_after) pair_with_before(ring, x, 0.5, 0.5 * neighbour, sums);
  return sums;
}

}  // namespace

void CollapseRing::clear() {
  before.clear();
  after.clear();
  samples_before.clear();
  neighbours_after.clear();
}

dvec3 closest_position(const CollapseRing& ring, const dvec3& start, double tolerance) {
  dvec3 x = start;
  for (int i = 0; i < kMaxIterations; ++i) {
    const std::optional<dvec3> solution = pair_closest_points(ring, x).solution();
    if (!solution) break;
    const bool has_converged = squared(*solution - x) < tolerance * tolerance;
    x = *solution;
    if (has_converged) break;
  }
  return x;
}

Placement keep_vertex(const CollapseRing& ring, const dvec3& position) {
  return {position, std::sqrt(pair_closest_points(ring, position).max_distance2)};
}

dvec3 restore_area(const CollapseRing& ring, const dvec3& from, const dvec3& to) {
  // Twice the areas. Between two near points the area is nearly linear.
  double before = 0;
  for (const auto& [a, b, c] : ring.before) before += glm::length(glm::cross(b - a, c - a));
  const auto area_after = [&](const dvec3& x) {
    double area = 0;
    for (const auto& [q, s] : ring.after) area += glm::length(glm::cross(q - x, s - x));
    return area;
  };
  const double at_from = area_after(from), at_to = area_after(to);
  if (at_from == at_to) return from;
  return from + std::clamp((before - at_from) / (at_to - at_from), 0.0, 1.0) * (to - from);
}

dvec3 with_same_volume(const CollapseRing& ring, const dvec3& x) {
  // Six times the volume of the tetrahedra over the triangles, seen from x itself: before it is a number, after it is a
  // linear function of x's displacement, whose gradient is twice the area vector of the ring.
  constexpr double kFold = 0.1;  // area vector against area at which a ring counts as half folded
  double volume = 0, area = 0;
  for (const auto& [a, b, c] : ring.before) volume += glm::dot(a - x, glm::cross(b - a, c - a));
  dvec3 gradient(0.0);
  for (const auto& [q, s] : ring.after) {
    const dvec3 area_vector = glm::cross(q - x, s - x);
    gradient += area_vector;
    area += glm::length(area_vector);
  }
  const double damped = squared(gradient) + kFold * kFold * area * area;
  return damped > 0 ? x + gradient * (volume / damped) : x;
}

std::optional<dvec3> with_same_border_area(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& q,
                                           const dvec3& x) {
  const dvec3 along = q - p;
  const double length2 = squared(along);
  if (!(length2 > 1e-4 * squared(b - a))) return std::nullopt;
  // Twice the area vector of the polygon p a b q must be that of the triangle p x q: (x - p) x (q - p).
  dvec3 area = glm::cross(a - p, b - p) + glm::cross(b - p, along);
  area -= along * (glm::dot(area, along) / length2);
  return p + glm::cross(along, area) / length2 + along * (glm::dot(x - p, along) / length2);
}

dvec3 closest_barycentric(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
  // [Ericson 2005, 5.1.5]: by Voronoi regions of corners, edges, inside.
  const dvec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const dvec3 bp = p - b;
  const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const dvec3 cp = p - c;
  const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};

  // Below this sine of the angle at a, va, vb and vc are mostly rounding.
  constexpr double kMinSine = 1e-5;
  const double area2 = squared(glm::cross(ab, ac));
  if (!(area2 > kMinSine * kMinSine * squared(ab) * squared(ac))) return closest_on_longest_edge(p, a, b, c);
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = d1 / (d1 - d3);
    return {1 - t, t, 0};
  }
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = d2 / (d2 - d6);
    return {1 - t, 0, t};
  }
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double v = vb / (va + vb + vc), w = vc / (va + vb + vc);
  return {1 - v - w, v, w};
}

}  // namespace farfield
