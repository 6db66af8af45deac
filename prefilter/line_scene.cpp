// SPDX-License-Identifier: Apache-2.0
#include "prefilter/line_scene.h"

#include <algorithm>
#include <utility>

#include "base/hash.h"
#include "base/nonfinite.h"
#include "base/parallel_job.h"
#include "prefilter/isotropic_lines.h"

namespace farfield {
namespace {

/// In voxels: a hit where no voxel is stored counts for a voxel this close on its line.
constexpr double kNearby = 2;

}  // namespace

Result<LineScene> LineScene::build(const OpacityScene& geometry, const Surface& macrosurface,
                                   const SparseVolume& volume) {
  LineScene scene(geometry, volume);
  if (macrosurface.triangles.empty()) return scene;
  FARFIELD_TRY_LET(auto macrosurface_scene, OpacityScene::build(macrosurface));
  scene.add_macrosurface(std::move(macrosurface_scene), macrosurface.bounds());
  return scene;
}

LineScene::LineScene(const OpacityScene& geometry, const SparseVolume& volume)
    : geometry_(&geometry), grid_(volume), lattice_(volume.lattice) {}

void LineScene::add_macrosurface(OpacityScene scene, const Box3& bounds) {
  macrosurface_scene_ = std::move(scene);
  // It may reach further than the volume.
  const dvec3 lower = glm::min(grid_.box().lower, (dvec3(bounds.lower) - lattice_.origin) / lattice_.voxel_size);
  const dvec3 upper = glm::max(grid_.box().upper, (dvec3(bounds.upper) - lattice_.origin) / lattice_.voxel_size);
  before_ += glm::length(upper - lower);
}

void LineScene::look(SeenLine& line, float far, double before, SplitMix& random) const {
  const auto along_ray = [&](float distance) {
    return std::clamp(static_cast<double>(distance) / lattice_.voxel_size - before, 0.0, line.ray.far);
  };
  if (macrosurface_scene_) {
    if (const auto wall = macrosurface_scene_->first_stop(line.origin, line.direction, far, random)) {
      far = wall->distance;
      line.ray.far = along_ray(far);
    }
  }
  line.hit = geometry_->first_stop(line.origin, line.direction, far, random);
  if (line.hit) line.hit_at = along_ray(line.hit->distance);
}

SeenLine LineScene::cast(const VoxelRay& ray, SplitMix& random) const {
  SeenLine line;
  line.ray = ray;
  line.origin = vec3(lattice_.origin + (ray.origin - before_ * ray.direction) * lattice_.voxel_size);
  line.direction = glm::normalize(vec3(ray.direction));
  look(line, static_cast<float>((before_ + ray.far) * lattice_.voxel_size), before_, random);
  return line;
}

SeenLine LineScene::cast_on(const vec3& from, const vec3& direction, float near, SplitMix& random) const {
  SeenLine line;
  line.origin = from + near * direction;
  line.direction = direction;
  line.ray = {(dvec3(line.origin) - lattice_.origin) / lattice_.voxel_size, dvec3(direction), 0, kInfinity};
  look(line, kInfinity, 0, random);
  return line;
}

std::optional<uint32_t> LineScene::voxel_of_hit(const SeenLine& line) const {
  std::optional<uint32_t> found;
  VoxelRay before = line.ray, behind = line.ray;
  before.near = std::max(0.0, line.hit_at - kNearby), before.far = line.hit_at;
  grid_.walk(before, [&](uint32_t voxel, double, double) { return found = voxel, true; });
  if (found) return found;
  behind.near = line.hit_at, behind.far = line.hit_at + kNearby;
  grid_.walk(behind, [&](uint32_t voxel, double, double) { return found = voxel, false; });
  return found;
}

std::optional<Collision> first_collision(const SparseVolume& volume, const VoxelGrid& grid, const VoxelRay& ray,
                                         SplitMix& random) {
  double left = -std::log1p(-random.next_unit());
  std::optional<Collision> found;
  walk_octant_depths(volume, grid, ray, [&](const OctantStretch& at, double depth) {
    if (depth > left) found = {at.voxel, at.enter + left / depth * (at.leave - at.enter)};
    left -= depth;
    return !found;
  });
  return found;
}

Result<void> for_lines(const LineScene& scene, const LinePass& pass,
                       const std::function<void(const SeenLine&, SplitMix&)>& body) {
  constexpr size_t kGrain = 1024;
  const auto count = static_cast<size_t>(std::ceil(pass.lines));
  const bool is_done = parallel_for(pass.job, "see", count, kGrain, [&](size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) {
      SplitMix random(mix64(pass.seed, i));
      body(scene.cast(isotropic_line(scene.grid().box(), even_coordinates(i, pass.seed)), random), random);
    }
  });
  if (!is_done) return make_error(ErrorCode::Cancelled, "voxelize: cancelled");
  return {};
}

}  // namespace farfield
