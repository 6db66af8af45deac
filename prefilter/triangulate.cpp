// SPDX-License-Identifier: Apache-2.0
#include "prefilter/triangulate.h"

#include <algorithm>
#include <tuple>

#include "prefilter/fill_rings.h"

namespace farfield {
namespace {

/// Normal of a triangle, as long as twice its area.
dvec3 normal(const dvec3& a, const dvec3& b, const dvec3& c) { return glm::cross(b - a, c - a); }

std::vector<uvec3> triangulate_quad(std::span<const dvec3> p) {
  // A diagonal lies inside when the two triangles face the same way.
  const double inside_02 = glm::dot(normal(p[0], p[1], p[2]), normal(p[0], p[2], p[3]));
  const double inside_13 = glm::dot(normal(p[1], p[2], p[3]), normal(p[1], p[3], p[0]));
  const double length_02 = glm::length(p[2] - p[0]), length_13 = glm::length(p[3] - p[1]);
  bool cut_02 = inside_02 > 0;
  if ((inside_02 > 0) == (inside_13 > 0)) {
    // Of equal diagonals (a rectangle's) the one at the smallest corner: the same whichever corner the polygon starts
    // with and whichever way round it goes, so coincident faces stay coincident.
    const auto less = [](const dvec3& a, const dvec3& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
    const auto smallest = std::min_element(p.begin(), p.end(), less) - p.begin();
    const bool is_equal = std::abs(length_02 - length_13) <= 1e-6 * length_02;
    cut_02 = is_equal ? smallest % 2 == 0 : length_02 < length_13;
  }
  if (cut_02) return {{0, 1, 2}, {0, 2, 3}};
  return {{1, 2, 3}, {1, 3, 0}};
}

/// Newell's normal: the mean normal of a polygon that need not be plane.
dvec3 mean_normal(std::span<const dvec3> p) {
  dvec3 sum(0.0);
  // Relative to the first corner, so that far-away polygons keep their digits.
  for (size_t i = 1; i + 1 < p.size(); ++i) sum += normal(p[0], p[i], p[i + 1]);
  return sum;
}

std::vector<uvec3> triangulate_ngon(std::span<const dvec3> p) {
  const dvec3 n = mean_normal(p);
  const double length = glm::length(n);
  if (!(length > 0)) return {};  // no area, whatever way one looks
  const dvec3 z = n / length;
  const dvec3 x = glm::normalize(glm::cross(std::abs(z.x) < 0.7 ? dvec3(1, 0, 0) : dvec3(0, 1, 0), z));
  const dvec3 y = glm::cross(z, x);
  std::vector<glm::dvec2> points;
  Ring ring;
  for (const dvec3& corner : p) {
    ring.push_back(static_cast<uint32_t>(points.size()));
    points.emplace_back(glm::dot(corner - p[0], x), glm::dot(corner - p[0], y));
  }
  const size_t given = points.size();
  Filling filling = fill_rings(std::move(points), {&ring, 1}, Winding::Nonzero);
  // Polygons that cross themselves: their corners are all there is, so a crossing goes to the nearest of them.
  for (uvec3& t : filling.triangles) {
    for (int k = 0; k < 3; ++k) {
      if (t[k] >= given) t[k] = filling.nearest[t[k] - given];
    }
  }
  std::erase_if(filling.triangles, [](const uvec3& t) { return t.x == t.y || t.y == t.z || t.z == t.x; });
  return std::move(filling.triangles);
}

}  // namespace

std::vector<uvec3> triangulate_polygon(std::span<const dvec3> corners) {
  if (corners.size() < 3) return {};
  for (const dvec3& c : corners) {
    if (!std::isfinite(c.x) || !std::isfinite(c.y) || !std::isfinite(c.z)) return {};
  }
  if (corners.size() == 3) return {{0, 1, 2}};
  return corners.size() == 4 ? triangulate_quad(corners) : triangulate_ngon(corners);
}

}  // namespace farfield
