// SPDX-License-Identifier: Apache-2.0
// Free flights through a level's brick volume.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "base/float4.h"
#include "base/vec.h"
#include "cache/level.h"

namespace farfield {

/// Bricks are skimmed up to this many expected tentative collisions, each of which costs as much as a few voxels.
inline constexpr float kMostSkimmed = 2.0f;

/// A collision with a flake.
struct VolumeHit {
  float t;            ///< ray parameter
  uint32_t payload;   ///< index into the voxel sections
  float attenuation;  ///< that the flight had there, per unit of t: rho sqrt(d^T S d), times the share
};

/// A ray in the local space of a level: points origin + t * direction, t in [t_near, t_far]. The direction need not be
/// unit: what a world ray of unit direction becomes under the instance's transform.
struct LocalRay {
  vec3 origin;
  vec3 direction;
  float t_near;
  float t_far;
};

/// Where along the ray the box lies: [t_near, t_far] cut to it; empty (t_near > t_far) if the ray misses it. Rays in
/// the plane of a side are inside. For rays that is_traceable().
struct RayRange {
  float t_near;
  float t_far;
  bool is_empty() const { return !(t_near <= t_far); }
};
/// Of origin and direction the first three lanes count.
inline RayRange clip_to_box(const Float4& origin, const Float4& direction, float t_near, float t_far, const Box3& box) {
  const Float4 inverse = 1.0f / direction;
  // Parallel rays give infinities of the right signs, or NaN (0 * infinity) in the plane of a side: min4 and max4 keep
  // their first argument then, which leaves the range as it is.
  const Float4 lower = load4(&box.lower.x), last_four = load4(&box.lower.z);  // not beyond the box
  const Float4 upper = __builtin_shufflevector(last_four, last_four, 1, 2, 3, 3);
  const Float4 a = (lower - origin) * inverse;
  const Float4 b = (upper - origin) * inverse;
  const Float4 near = max4(splat4(t_near), min4(a, b)), far = min4(splat4(t_far), max4(a, b));
  return {std::max(std::max(near[0], near[1]), near[2]), std::min(std::min(far[0], far[1]), far[2])};
}
inline RayRange clip_to_box(const LocalRay& ray, const Box3& box) {
  return clip_to_box(load_xyz(ray.origin), load_xyz(ray.direction), ray.t_near, ray.t_far, box);
}

/// No NaN, no infinity, and nothing beyond what Embree takes. Zero directions are traceable. The same lanes count.
inline bool is_traceable(const Float4& origin, const Float4& direction) {
  const Float4 size = abs4(origin) + abs4(direction);
  return size[0] + size[1] + size[2] <= kEmbreeLargest;
}
inline bool is_traceable(const LocalRay& ray) { return is_traceable(load_xyz(ray.origin), load_xyz(ray.direction)); }

/// The microflake volume of a level, as rays see it. Refers to the level's arrays. Immutable; any thread.
class BrickVolume {
 public:
  BrickVolume() = default;
  explicit BrickVolume(const LevelView& level);

  bool is_empty() const { return bricks_.empty(); }

  /// Draws the first collision in [t_near, t_far], or none. Exact for the piecewise constant medium:
  /// P(no collision before t) = exp(-integral of rho sqrt(d^T S d) dt), d the unnormalised direction. That integral is
  /// the same in every space that an affine map leads to, so instances keep their transmittance under any transform
  /// (the flakes are carried along). A pure function of the arguments: the same seed gives the same collision, whatever
  /// t_far beyond it. Zero direction, NaN or infinite origins: none. share, in (0, 1]: of the flakes that are there;
  /// all densities are so much lower.
  std::optional<VolumeHit> first_collision(const LocalRay& ray, uint64_t seed, float share = 1) const;
  /// That integral over [t_near, t_far], up to rounding: exp(-optical_depth) of the light passes. 0 where there is no
  /// collision.
  float optical_depth(const LocalRay& ray) const;
  /// What that integral grows by per unit of t at a point: rho sqrt(d^T S d). 0 outside.
  float attenuation_at(const vec3& point, const vec3& direction) const;

 private:
  struct Flight;
  struct Course;
  [[gnu::always_inline]] bool find_course(const LocalRay& ray, Course& course) const;  // a call costs rays 5 %
  float depth_of_brick(const Course& course, const Brick& brick, const ivec3& brick_cell, float s_begin,
                       float s_end) const;
  void find_what_is_occupied(const LevelView& level);
  /// What sigma_t is at most for a density of 1 / scene unit.
  float attenuation_bound() const;
  bool cross_brick(Flight& flight, const Brick& brick, const ivec3& brick_cell, float s_begin, float s_end) const;
  bool skim_brick(Flight& flight, const Brick& brick, const ivec3& brick_cell, float s_begin, float s_end) const;
  /// sqrt(d^T S d) / |d| of the voxel, d the ray's direction.
  float projected_area(uint32_t payload, const vec3& unit_direction) const;
  PackedOctants octants_of(uint32_t payload) const;
  bool cross_octants(Flight& flight, const ivec3& voxel, const vec3& entry, float rate, float s_begin,
                     float s_end) const;

  ArrayView<uint32_t> brick_table_;
  ArrayView<Brick> bricks_;
  ArrayView<PackedFlakeSggx> voxel_sggx_;
  ArrayView<PackedOctants> voxel_octants_;
  ivec3 brick_dims_{0};
  vec3 origin_{0.0f};
  float inverse_voxel_size_ = 0;
  Box3 occupied_;            ///< of voxels that are not empty; in voxels
  float densest_scale_ = 0;  ///< the largest density_scale of all bricks
};

}  // namespace farfield
