// SPDX-License-Identifier: Apache-2.0
// The geometry of a level and its volume, as long lines through both see them.
#pragma once

#include <cmath>
#include <functional>
#include <optional>

#include "base/job.h"
#include "base/result.h"
#include "base/split_mix.h"
#include "prefilter/ray_scene.h"
#include "prefilter/surface.h"
#include "prefilter/voxel_walk.h"
#include "prefilter/voxelize.h"

namespace farfield {

/// A line through the volume, up to where the macrosurface stops it, and what it sees of the geometry.
struct SeenLine {
  VoxelRay ray;
  std::optional<RayHit> hit;  ///< on the geometry; the distance is from `origin`, in scene units
  double hit_at = 0;          ///< along `ray`
  vec3 origin{0.0f};          ///< where the line starts, outside everything, in the space of positions
  vec3 direction{0.0f};       ///< unit

  vec3 point() const { return origin + hit->distance * direction; }
  /// How far it sees into the volume, along `ray`.
  double seen_until() const { return hit ? hit_at : ray.far; }
};

/// Refers to the scene of the geometry. Immutable; any thread.
class LineScene {
 public:
  /// `volume` is a voxelisation of `geometry`; only where its voxels are matters, and must stay. The macrosurface is
  /// what the level shows as it is. Errors: those of RayScene::build().
  static Result<LineScene> build(const OpacityScene& geometry, const Surface& macrosurface, const SparseVolume& volume);

  const Surface& geometry() const { return geometry_->surface(); }
  const VoxelGrid& grid() const { return grid_; }
  const VoxelLattice& lattice() const { return lattice_; }

  /// `ray` starts on the surface of grid().box(). `random` is used only where faces are not opaque.
  SeenLine cast(const VoxelRay& ray, SplitMix& random) const;
  /// Light that goes on from this point, `near` away from it, and what it sees of the geometry; its ray ends where the
  /// macrosurface stops it.
  SeenLine cast_on(const vec3& from, const vec3& direction, float near, SplitMix& random) const;
  /// The point so far along a ray through the volume, in the space of positions.
  vec3 point_along(const VoxelRay& ray, double at) const {
    return vec3(lattice_.origin + lattice_.voxel_size * (ray.origin + at * ray.direction));
  }
  /// The stored voxel that a hit belongs to: the one where it is or, if that is not stored, one close by on the line.
  std::optional<uint32_t> voxel_of_hit(const SeenLine& line) const;

  bool is_stopped_by_geometry(const vec3& origin, const vec3& direction, float near, float far,
                              SplitMix& random) const {
    return geometry_->is_stopped(origin, direction, near, far, random);
  }
  bool is_stopped_by_macrosurface(const vec3& origin, const vec3& direction, float near, float far,
                                  SplitMix& random) const {
    return macrosurface_scene_ && macrosurface_scene_->is_stopped(origin, direction, near, far, random);
  }

 private:
  LineScene(const OpacityScene& geometry, const SparseVolume& volume);
  void add_macrosurface(OpacityScene scene, const Box3& bounds);
  /// Fills in what a line sees whose ray begins `before` voxels behind its origin, and where it ends.
  void look(SeenLine& line, float far, double before, SplitMix& random) const;

  const OpacityScene* geometry_;
  std::optional<OpacityScene> macrosurface_scene_;
  VoxelGrid grid_;
  VoxelLattice lattice_;
  double before_ = 1;  ///< in voxels: how far before the volume lines start
};

/// Lines of one purpose.
struct LinePass {
  double lines = 0;   ///< how many, rounded up
  uint64_t seed = 0;  ///< equal seeds give equal lines
  Job job{};          ///< reports from the calling thread alone
};

/// Casts isotropic lines and calls body(line, a random stream of its own) for each, from several threads. What body is
/// called with does not depend on their number. Errors: Cancelled. The volume is not empty.
Result<void> for_lines(const LineScene& scene, const LinePass& pass,
                       const std::function<void(const SeenLine&, SplitMix&)>& body);

/// sqrt(w^T S w) of a voxel along a unit direction w.
inline double projected_area(const Voxel& voxel, const vec3& direction) {
  return std::sqrt(std::max(0.0f, voxel.sggx.quadratic(direction)));
}

/// sigma_t of a voxel's full octants along a unit direction, in 1 / scene unit.
inline double sigma_of(const Voxel& voxel, const vec3& direction) {
  return static_cast<double>(voxel.density) * projected_area(voxel, direction);
}

/// An octant of a voxel along a ray.
struct OctantStretch {
  uint32_t voxel;
  int octant;
  double enter, leave;  ///< along the ray, in voxels
};

/// Calls visit(OctantStretch) for the octants of stored voxels along a ray, in order, while it returns true.
template <typename Visit>
void walk_octants(const VoxelGrid& grid, const VoxelRay& ray, Visit&& visit) {
  const dvec3 inverse = 1.0 / ray.direction;
  grid.walk(ray, [&](uint32_t number, double enter, double leave) {
    const ivec3 cell(glm::floor(ray.origin + 0.5 * (enter + leave) * ray.direction));
    return walk_octants(ray.origin, ray.direction, inverse, cell, enter, leave,
                        [&](int octant, double from, double to) {
                          return visit(OctantStretch{number, octant, from, to});
                        });
  });
}

/// Calls visit(octant, its optical depth) along a ray through a volume with this grid, in order, while it returns true.
template <typename Visit>
void walk_octant_depths(const SparseVolume& volume, const VoxelGrid& grid, const VoxelRay& ray, Visit&& visit) {
  const vec3 direction(ray.direction);
  const double size = volume.lattice.voxel_size;
  walk_octants(grid, ray, [&](const OctantStretch& at) {
    const Voxel& voxel = volume.voxels[at.voxel];
    const double share = octant_share(voxel.octants, at.octant);
    return visit(at, (at.leave - at.enter) * size * share * sigma_of(voxel, direction));
  });
}

/// Calls visit(number of the voxel, optical depth of one of its octants) along a ray.
template <typename Visit>
void visit_depths(const SparseVolume& volume, const VoxelGrid& grid, const VoxelRay& ray, Visit&& visit) {
  walk_octant_depths(volume, grid, ray, [&](const OctantStretch& at, double depth) {
    visit(at.voxel, depth);
    return true;
  });
}

/// Where the medium stops a line first.
struct Collision {
  uint32_t voxel = 0;
  double at = 0;  ///< along the line's ray, in voxels
};
std::optional<Collision> first_collision(const SparseVolume& volume, const VoxelGrid& grid, const VoxelRay& ray,
                                         SplitMix& random);

inline double optical_depth(const SparseVolume& volume, const VoxelGrid& grid, const VoxelRay& ray) {
  double depth = 0;
  visit_depths(volume, grid, ray, [&](uint32_t, double of_voxel) { depth += of_voxel; });
  return depth;
}

}  // namespace farfield
