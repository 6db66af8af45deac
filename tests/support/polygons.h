// SPDX-License-Identifier: Apache-2.0
// Plane polygons for tests.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "prefilter/fill_rings.h"

namespace farfield::test {

/// A star-shaped polygon with random radii: simple, and concave at about half its corners.
inline std::vector<glm::dvec2> random_star(std::mt19937& rng, int corners, double scale = 1) {
  std::uniform_real_distribution<double> radius(0.2, 1.0);
  std::vector<glm::dvec2> p;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * 3.14159265358979 * i / corners;
    p.push_back(scale * radius(rng) * glm::dvec2(std::cos(angle), std::sin(angle)));
  }
  return p;
}

/// begin, begin + 1, ... end - 1
inline Ring ring_of(size_t begin, size_t end) {
  Ring ring;
  for (size_t i = begin; i < end; ++i) ring.push_back(static_cast<Index>(i));
  return ring;
}

}  // namespace farfield::test
