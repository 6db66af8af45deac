// SPDX-License-Identifier: Apache-2.0
// [Loubet 2018, 8.2.2]; docs/theory.md, section 6.2. Points on the collapsed surface are weight * x + rest, so with
// fixed pairs of points the best x is a weighted mean; then the pairs are found anew. Both half steps lower the sum.
#include "prefilter/vertex_placement.h"

#include <algorithm>
#include <limits>
#include <span>

namespace farfield {

namespace {

constexpr int kMaxIterations = 64;  ///< the thesis allows 200 and needs 7 on average

/// Parameter in [0, 1] of the point of segment ab that is nearest to p.
double closest_on_segment(const dvec3& p, const dvec3& a, const dvec3& b) {
  const double length2 = squared_length(b - a);
  return length2 > 0 ? std::clamp(glm::dot(p - a, b - a) / length2, 0.0, 1.0) : 0.0;
}

dvec3 closest_on_longest_edge(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
  const double ab = squared_length(b - a), bc = squared_length(c - b), ca = squared_length(a - c);
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

/// The point of some triangles that is nearest to another.
struct Nearest {
  size_t triangle = 0;
  dvec3 weights{0.0};  ///< of its corners
  double distance2 = std::numeric_limits<double>::infinity();
};

/// The first of the nearest, or one that is no farther than `enough2`, a squared distance. point_of(triangle, weights)
/// adds up corners: in which order is part of what levels are, to the last bit.
template <typename PointOf>
Nearest find_nearest(std::span<const BoundedTriangle> triangles, const dvec3& p, double enough2,
                     const PointOf& point_of) {
  Nearest nearest;
  if (triangles.empty()) return nearest;
  const auto look_at = [&](size_t i) {
    const auto& [a, b, c] = triangles[i].corners;
    const dvec3 weights = closest_barycentric(p, a, b, c);
    const double distance2 = squared_length(point_of(triangles[i].corners, weights) - p);
    const bool is_nearer = distance2 < nearest.distance2 || (distance2 == nearest.distance2 && i < nearest.triangle);
    if (is_nearer) nearest = {i, weights, distance2};
  };

  // First the one whose middle is nearest: then most others are out of reach.
  size_t first = 0;
  double least2 = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < triangles.size(); ++i) {
    const double distance2 = squared_length(triangles[i].center - p);
    first = distance2 < least2 ? i : first;
    least2 = std::min(least2, distance2);
  }
  look_at(first);
  double distance = std::sqrt(nearest.distance2);
  for (size_t i = 0; i < triangles.size() && nearest.distance2 > enough2; ++i) {
    const double reach = distance + triangles[i].radius;
    if (i == first || squared_length(triangles[i].center - p) > reach * reach) continue;
    look_at(i);
    distance = std::sqrt(nearest.distance2);
  }
  return nearest;
}

constexpr double kNothing = -1;  ///< as `enough2`: only the nearest will do

Nearest nearest_before(const CollapseRing& ring, const dvec3& p, double enough2 = kNothing) {
  return find_nearest(ring.before, p, enough2, [](const Corners& t, const dvec3& weights) {
    return weights.x * t[0] + weights.y * t[1] + weights.z * t[2];
  });
}

Nearest nearest_after(std::span<const BoundedTriangle> after, const dvec3& p, double enough2 = kNothing) {
  return find_nearest(after, p, enough2, [](const Corners& t, const dvec3& weights) {
    return weights.x * t[0] + (weights.y * t[1] + weights.z * t[2]);
  });
}

std::vector<BoundedTriangle> triangles_after(const CollapseRing& ring, const dvec3& x) {
  std::vector<BoundedTriangle> triangles;
  triangles.reserve(ring.after.size());
  for (const auto& [q, s] : ring.after) triangles.push_back({x, q, s});
  return triangles;
}

/// Sums up weight * x + rest = target over all pairs of points.
struct LeastSquares {
  double weight2 = 0;
  dvec3 moment{0.0};

  void add(double weight, const dvec3& rest, const dvec3& target) {
    weight2 += weight * weight;
    moment += weight * (target - rest);
  }
  std::optional<dvec3> solution() const {
    if (!(weight2 > 0)) return std::nullopt;
    return moment / weight2;
  }
};

LeastSquares pair_closest_points(const CollapseRing& ring, const dvec3& x) {
  LeastSquares sums;
  const std::vector<BoundedTriangle> after = triangles_after(ring, x);
  for (const dvec3& p : ring.samples_before) {
    const Nearest nearest = nearest_after(after, p);
    const auto& [q, s] = ring.after[nearest.triangle];
    sums.add(nearest.weights.x, nearest.weights.y * q + nearest.weights.z * s, p);
  }
  const auto add_after = [&](double weight, const dvec3& rest) {
    const Nearest nearest = nearest_before(ring, weight * x + rest);
    const auto& [a, b, c] = ring.before[nearest.triangle].corners;
    sums.add(weight, rest, nearest.weights.x * a + nearest.weights.y * b + nearest.weights.z * c);
  };
  add_after(1.0, dvec3(0.0));
  for (const dvec3& neighbour : ring.neighbours_after) add_after(0.5, 0.5 * neighbour);
  return sums;
}

}  // namespace

BoundedTriangle::BoundedTriangle(const dvec3& a, const dvec3& b, const dvec3& c)
    : corners{a, b, c}, center((a + b + c) / 3.0) {
  // Weights of slivers leave [0, 1] a little, and points are rounded as coordinates are.
  constexpr double kOfRadius = 1.01, kOfCoordinates = 1e-12;
  const double radius2 = std::max({squared_length(a - center), squared_length(b - center), squared_length(c - center)});
  radius = kOfRadius * std::sqrt(radius2) + kOfCoordinates * glm::length(center);
}

void CollapseRing::clear() {
  before.clear();
  after.clear();
  samples_before.clear();
  neighbours_after.clear();
}

dvec3 closest_position(const CollapseRing& ring, const dvec3& start, double tolerance) {
  if (ring.before.empty() || ring.after.empty()) return start;
  dvec3 x = start;
  for (int i = 0; i < kMaxIterations; ++i) {
    const std::optional<dvec3> solution = pair_closest_points(ring, x).solution();
    if (!solution) break;
    const bool has_converged = squared_length(*solution - x) < tolerance * tolerance;
    x = *solution;
    if (has_converged) break;
  }
  return x;
}

double deviation_at(const CollapseRing& ring, const dvec3& x) {
  const std::vector<BoundedTriangle> after = triangles_after(ring, x);
  // A point no farther than the farthest yet is passed as soon as that is known.
  double farthest2 = 0;
  const auto see = [&](const Nearest& nearest) { farthest2 = std::max(farthest2, nearest.distance2); };
  for (const dvec3& p : ring.samples_before) see(nearest_after(after, p, farthest2));
  see(nearest_before(ring, x, farthest2));
  for (const dvec3& neighbour : ring.neighbours_after) see(nearest_before(ring, 0.5 * x + 0.5 * neighbour, farthest2));
  return std::sqrt(farthest2);
}

dvec3 restore_area(const CollapseRing& ring, const dvec3& from, const dvec3& to) {
  // Twice the areas. Between two near points the area is nearly linear.
  double before = 0;
  for (const BoundedTriangle& t : ring.before) before += glm::length(area_vector(t.corners));
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
  for (const BoundedTriangle& t : ring.before) volume += glm::dot(t.corners[0] - x, area_vector(t.corners));
  dvec3 gradient(0.0);
  for (const auto& [q, s] : ring.after) {
    const dvec3 area_vector = glm::cross(q - x, s - x);
    gradient += area_vector;
    area += glm::length(area_vector);
  }
  const double damped = squared_length(gradient) + kFold * kFold * area * area;
  return damped > 0 ? x + gradient * (volume / damped) : x;
}

std::optional<dvec3> with_same_border_area(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& q,
                                           const dvec3& x) {
  const dvec3 along = q - p;
  const double length2 = squared_length(along);
  if (!(length2 > 1e-4 * squared_length(b - a))) return std::nullopt;
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
  const double area2 = squared_length(glm::cross(ab, ac));
  if (!(area2 > kMinSine * kMinSine * squared_length(ab) * squared_length(ac)))
    return closest_on_longest_edge(p, a, b, c);
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
