// SPDX-License-Identifier: Apache-2.0
#include "prefilter/voxel_walk.h"

#include "base/check.h"

namespace farfield {
namespace {

VoxelBox bounds_of_voxels(const SparseVolume& volume) {
  ivec3 lower(std::numeric_limits<int>::max()), upper(std::numeric_limits<int>::min());
  for (const VoxelBrick& brick : volume.bricks) {
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (!is_set(brick.mask, i)) continue;
      const ivec3 voxel = voxel_of_brick(brick.coordinate, i);
      lower = glm::min(lower, voxel);
      upper = glm::max(upper, voxel + 1);
    }
  }
  return {dvec3(lower), dvec3(upper)};
}

}  // namespace

VoxelGrid::VoxelGrid(const SparseVolume& volume) {
  if (volume.bricks.empty()) return;
  FARFIELD_CHECK(volume.voxels.size() < kNoBrick);
  lower_ = upper_ = volume.bricks.front().coordinate;
  for (const VoxelBrick& brick : volume.bricks) {
    lower_ = glm::min(lower_, brick.coordinate);
    upper_ = glm::max(upper_, brick.coordinate + 1);
  }
  table_.assign(cell_of(upper_ - 1) + 1, kNoBrick);
  bricks_.reserve(volume.bricks.size());
  for (const VoxelBrick& source : volume.bricks) {
    table_[cell_of(source.coordinate)] = static_cast<uint32_t>(bricks_.size());
    Brick brick{source.mask, {}};
    auto next = static_cast<uint32_t>(source.first_voxel);
    for (size_t word = 0; word < brick.mask.size(); ++word) {
      brick.first_of_word[word] = next;
      next += static_cast<uint32_t>(__builtin_popcountll(brick.mask[word]));
    }
    bricks_.push_back(brick);
  }
  box_ = bounds_of_voxels(volume);
}

VoxelRay VoxelGrid::clipped(VoxelRay ray) const {
  const dvec3 all = ray.origin + ray.direction;
  if (bricks_.empty() || !std::isfinite(all.x + all.y + all.z)) ray.far = ray.near;
  for (int a = 0; a < 3; ++a) {
    const double inverse = 1 / ray.direction[a];
    // A ray in the plane of a side gives NaN, which std::min and std::max leave out: see clip_to_box in bvh.
    const double x = (box_.lower[a] - ray.origin[a]) * inverse, y = (box_.upper[a] - ray.origin[a]) * inverse;
    ray.near = std::max(ray.near, std::min(x, y));
    ray.far = std::min(ray.far, std::max(x, y));
  }
  return ray;
}

}  // namespace farfield
