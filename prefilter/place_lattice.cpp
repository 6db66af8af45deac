// SPDX-License-Identifier: Apache-2.0
// Positions along an axis, modulo a voxel, lie on a circle; their mean on it is where most of the geometry is, and
// becomes the middle of voxels. What is spread over many voxels adds nothing to it, so that a trunk decides for its
// crown.
#include "prefilter/place_lattice.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "prefilter/isotropic_lines.h"
#include "prefilter/triangle_pieces.h"

namespace farfield {
namespace {

constexpr uint64_t kPoints = 16384;  ///< leave 1 % of a voxel's circle to chance

/// Points spread evenly over what stops rays. None if there is no area.
std::vector<dvec3> spread_points(const Surface& geometry) {
  std::vector<double> area_until;
  double area = 0;
  for (size_t f = 0; f < geometry.triangles.size(); ++f) {
    area += glm::length(area_vector_of(corners_of(geometry, f))) *
            static_cast<double>(geometry.materials[f].stopped_share());
    area_until.push_back(area);
  }
  std::vector<dvec3> points;
  if (!(area > 0)) return points;
  points.reserve(kPoints);
  for (uint64_t i = 0; i < kPoints; ++i) {
    const auto u = even_coordinates(i, 0);
    const auto found = std::upper_bound(area_until.begin(), area_until.end() - 1, u[0] * area);
    const auto face = static_cast<size_t>(found - area_until.begin());
    points.push_back(point_on(corners_of(geometry, face), u[1], u[2]));
  }
  return points;
}

/// Where the mean of positions is, modulo 1, in [-0.5, 0.5].
double circular_mean(const std::vector<double>& positions) {
  double cosines = 0, sines = 0;
  for (const double x : positions) {
    cosines += std::cos(2 * M_PI * x);
    sines += std::sin(2 * M_PI * x);
  }
  return std::atan2(sines, cosines) / (2 * M_PI);
}

}  // namespace

VoxelLattice place_lattice(const Surface& geometry, const dvec3& middle, double voxel_size) {
  const std::vector<dvec3> points = spread_points(geometry);
  std::vector<double> positions(points.size());
  dvec3 origin;
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), positions.begin(),
                   [&](const dvec3& point) { return (point[axis] - middle[axis]) / voxel_size; });
    const double mean = circular_mean(positions);
    origin[axis] = mean > 0 ? mean - 0.5 : mean + 0.5;  // the mean, half a voxel from a corner
  }
  return {middle + origin * voxel_size, voxel_size};
}

}  // namespace farfield
