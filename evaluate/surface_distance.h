// SPDX-License-Identifier: Apache-2.0
// How far two surfaces are from each other, whatever has made one of the other.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "evaluate/nearest_point_grid.h"
#include "evaluate/surface_area.h"
#include "prefilter/surface.h"

namespace farfield {

struct SurfaceDistance {
  double farthest = 0, rms = 0;  ///< scene units
};

/// From `samples` points, spread evenly over the area of `from`, to the nearest points of `to`. Neither is empty;
/// triangles have area.
inline SurfaceDistance one_sided_distance(const Surface& from, const Surface& to, int samples) {
  std::vector<double> area_below;
  double area = 0;
  for (size_t f = 0; f < from.triangles.size(); ++f) area_below.push_back(area += face_area(from, f));
  const NearestPointGrid nearest(to);
  Rng rng(5);
  double farthest = 0, sum2 = 0;
  for (int i = 0; i < samples; ++i) {
    const auto found = std::upper_bound(area_below.begin(), area_below.end(), rng.next() * area);
    const auto f = std::min<size_t>(static_cast<size_t>(found - area_below.begin()), area_below.size() - 1);
    const float root = std::sqrt(rng.next()), v = rng.next();
    const uvec3& t = from.triangles[f];
    const vec3 p =
        (1 - root) * from.positions[t.x] + root * (1 - v) * from.positions[t.y] + root * v * from.positions[t.z];
    const double d = nearest.distance(p);
    farthest = std::max(farthest, d);
    sum2 += d * d;
  }
  return {farthest, std::sqrt(sum2 / samples)};
}

/// The larger of both sides.
inline SurfaceDistance two_sided_distance(const Surface& a, const Surface& b, int samples) {
  const SurfaceDistance there = one_sided_distance(a, b, samples), back = one_sided_distance(b, a, samples);
  return {std::max(there.farthest, back.farthest), std::max(there.rms, back.rms)};
}

}  // namespace farfield
