// SPDX-License-Identifier: Apache-2.0
// Corners by brute force: every three of the 50 planes meet in a point, and it is a corner if it lies inside the other
// planes. 20 thousand triples, once per bake.
#include "bake/slab_hull.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfield {
namespace {

struct Plane {
  dvec3 normal;
  double offset;  ///< inside: dot(normal, p) <= offset
};

std::vector<vec3> box_corners(const dvec3& lower, const dvec3& upper) {
  std::vector<vec3> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back(dvec3(i & 1 ? upper.x : lower.x, i & 2 ? upper.y : lower.y, i & 4 ? upper.z : lower.z));
  }
  return corners;
}

}  // namespace

SlabHull::SlabHull() {
  size_t count = 0;
  const auto add_axis = [&](double x, double y, double z) { axes_[count++] = glm::normalize(dvec3(x, y, z)); };
  for (int axis = 0; axis < 3; ++axis) {  // 3 faces, 6 edges, 12 between them, of a cube
    dvec3 a(0), b(0), c(0);
    a[axis] = 1, b[(axis + 1) % 3] = 1, c[(axis + 2) % 3] = 1;
    const auto add_vector = [&](const dvec3& v) { add_axis(v.x, v.y, v.z); };
    add_vector(a);
    for (const double sign : {1.0, -1.0}) {
      add_vector(a + sign * b);
      add_vector(2.0 * a + sign * b);
      add_vector(2.0 * a + sign * c);
    }
  }
  for (int i = 0; i < 4; ++i) add_axis(1, i & 1 ? 1 : -1, i & 2 ? 1 : -1);  // 4 corners
  lower_.fill(std::numeric_limits<double>::infinity());
  upper_.fill(-std::numeric_limits<double>::infinity());
}

void SlabHull::add(const vec3& point) {
  for (size_t i = 0; i < kAxisCount; ++i) {
    const double d = glm::dot(axes_[i], dvec3(point));
    lower_[i] = std::min(lower_[i], d);
    upper_[i] = std::max(upper_[i], d);
  }
}

void SlabHull::add(const Box3& box) {
  if (box.is_empty()) return;
  for (const vec3& corner : box_corners(dvec3(box.lower), dvec3(box.upper))) add(corner);
}

std::vector<vec3> SlabHull::corners() const {
  if (!(lower_[0] <= upper_[0])) return {};
  double extent = 1e-30;  // a single point at the origin gets a body too
  for (size_t i = 0; i < kAxisCount; ++i) {
    extent = std::max({extent, upper_[i] - lower_[i], 1e-2 * std::abs(lower_[i]), 1e-2 * std::abs(upper_[i])});
  }
  // The margin is larger than what rounding to float and merging of close corners take away below.
  const double margin = 2e-5 * extent, merge = 2e-6 * extent;
  std::array<Plane, 2 * kAxisCount> planes;
  for (size_t i = 0; i < kAxisCount; ++i) {
    planes[2 * i] = {axes_[i], upper_[i] + margin};
    planes[2 * i + 1] = {-axes_[i], -lower_[i] + margin};
  }

  std::vector<dvec3> found;
  for (size_t i = 0; i < planes.size(); ++i) {
    for (size_t j = i + 1; j < planes.size(); ++j) {
      const dvec3 line = glm::cross(planes[i].normal, planes[j].normal);
      for (size_t k = j + 1; k < planes.size(); ++k) {
        const double determinant = glm::dot(line, planes[k].normal);
        if (std::abs(determinant) < 1e-6) continue;
        const dvec3 point =
            (planes[i].offset * glm::cross(planes[j].normal, planes[k].normal) +
             planes[j].offset * glm::cross(planes[k].normal, planes[i].normal) + planes[k].offset * line) /
            determinant;
        const bool is_inside = std::all_of(planes.begin(), planes.end(), [&](const Plane& plane) {
          return glm::dot(plane.normal, point) <= plane.offset + 0.1 * merge;
        });
        if (!is_inside) continue;
        const bool is_new = std::none_of(found.begin(), found.end(),
                                         [&](const dvec3& other) { return glm::length(other - point) < merge; });
        if (is_new) found.push_back(point);
      }
    }
  }
  return {found.begin(), found.end()};
}

}  // namespace farfield
