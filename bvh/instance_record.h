// SPDX-License-Identifier: Apache-2.0
// An instance of an asset: where it stands, and what it asks of levels.
#pragma once

#include <cstdint>

#include "base/result.h"
#include "base/vec.h"
#include "bvh/level_choice.h"
#include "bvh/traced_asset.h"

namespace farfield {

/// One instance: what a ray needs in one cache line.
struct alignas(64) InstanceRecord {
  mat4x3 world_to_local;
  InstanceFootprint footprint;
  uint32_t asset = 0;
  int8_t handedness = 1;  ///< sign of the transform's determinant
  LevelLimits limits;
  bool moves = false;  ///< while the shutter is open: the matrix is that of its beginning (bvh/instance_motion.h)

  vec3 point_to_local(const vec3& p) const { return vector_to_local(p) + world_to_local[3]; }
  vec3 vector_to_local(const vec3& v) const {
    return world_to_local[0] * v.x + world_to_local[1] * v.y + world_to_local[2] * v.z;
  }
  /// World-space normal of a local one, up to scale: transpose(W2L) n; flips under mirroring like a flattened mesh's.
  vec3 normal_to_world(const vec3& n) const;
  /// The linear part of world_to_local.
  mat3 linear_to_local() const;
  /// The matrix and the handedness, of world_to_local's linear part and translation; its determinant is not 0.
  void set_inverse(const glm::dmat3& linear, const glm::dvec3& translation);
};
static_assert(sizeof(InstanceRecord) == 64);

/// An instance of `asset`, footprint not set. Errors: InvalidArgument (not finite, not invertible in float).
Result<InstanceRecord> make_instance(uint32_t asset, const mat4x3& local_to_world);
/// The same as an instance of what stands at a place of its asset's level: its local space is the part's.
InstanceRecord placed(const InstanceRecord& instance, const PartPlacement& placement);
/// The largest factor by which the transform stretches a length: what instance scales mean for footprints, so that
/// an instance that is squeezed along one axis keeps the detail along the others.
float largest_stretch(const mat4x3& local_to_world);
/// World bounds that contain all that rays can hit of the instance, rounding included.
Box3 instance_bounds(const InstanceRecord& instance, const TracedAsset& asset);

}  // namespace farfield
