// SPDX-License-Identifier: Apache-2.0
// Two ways to see through geometry: its triangles and a volume of it.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/embree.h"
#include "prefilter/surface.h"
#include "prefilter/voxelize.h"

namespace farfield::test {

/// The triangles, to cast long rays at.
class MeshScene {
 public:
  explicit MeshScene(const Surface& surface) : device_(*make_embree_device()) {
    const EmbreeGeometry triangles = new_triangles(device_.get());
    copy_array<vec3>(triangles.get(), surface.positions);
    copy_array<uvec3>(triangles.get(), surface.triangles);
    scene_ = build_static_scene(device_.get(), triangles);
  }

  bool is_hit(const vec3& origin, const vec3& direction) const {
    EmbreeContext context = make_context();
    EmbreeRay ray = make_ray(origin, direction);
    return trace_occlusion(scene_.get(), context, ray);
  }

 private:
  EmbreeDevice device_;
  EmbreeScene scene_;
};

/// A volume as a dense array, to look along long rays.
class VolumeScene {
 public:
  explicit VolumeScene(const SparseVolume& volume) : volume_(volume) {
    ivec3 upper(std::numeric_limits<int>::min());
    lower_ = ivec3(std::numeric_limits<int>::max());
    for (const VoxelBrick& brick : volume.bricks) {
      lower_ = glm::min(lower_, brick.coordinate * kBrickSide);
      upper = glm::max(upper, (brick.coordinate + 1) * kBrickSide);
    }
    size_ = glm::max(upper - lower_, ivec3(0));
    voxels_.resize(static_cast<size_t>(size_.x) * static_cast<size_t>(size_.y) * static_cast<size_t>(size_.z));
    for (const VoxelBrick& brick : volume.bricks) {
      uint64_t index = brick.first_voxel;
      for (int i = 0; i < kBrickVoxels; ++i) {
        if (!is_set(brick.mask, i)) continue;
        at(voxel_of_brick(brick.coordinate, i) - lower_) = &volume.voxels[index++];
      }
    }
  }

  /// exp(-optical depth) along the first 6 units of a ray, by equal steps of 1/8 of a voxel.
  double transmittance(const vec3& origin, const vec3& direction) {
    const double step = volume_.lattice.voxel_size / 8;
    double depth = 0;
    for (double t = 0.5 * step; t < 6; t += step) {
      const dvec3 p = (dvec3(origin) + t * dvec3(direction) - volume_.lattice.origin) / volume_.lattice.voxel_size;
      const ivec3 c = ivec3(glm::floor(p)) - lower_;
      if (glm::any(glm::lessThan(c, ivec3(0))) || glm::any(glm::greaterThanEqual(c, size_))) continue;
      const Voxel* voxel = at(c);
      if (!voxel) continue;
      const dvec3 in_voxel = glm::fract(p);
      const int octant = (in_voxel.x >= 0.5) + 2 * (in_voxel.y >= 0.5) + 4 * (in_voxel.z >= 0.5);
      depth += step * octant_share(voxel->octants, octant) * voxel->density *
               std::sqrt(std::max(voxel->sggx.quadratic(direction), 0.0f));
    }
    return std::exp(-depth);
  }

 private:
  const Voxel*& at(const ivec3& c) {
    return voxels_[static_cast<size_t>(c.x) +
                   static_cast<size_t>(size_.x) *
                       (static_cast<size_t>(c.y) + static_cast<size_t>(size_.y) * static_cast<size_t>(c.z))];
  }

  const SparseVolume& volume_;
  ivec3 lower_, size_;
  std::vector<const Voxel*> voxels_;
};

}  // namespace farfield::test
