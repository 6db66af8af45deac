// SPDX-License-Identifier: Apache-2.0
// Which rays a face stops: it may be clear in places, stand for pieces with gaps, or be half there.
#pragma once

#include <cstdint>

#include "base/embree.h"
#include "base/vec.h"
#include "bvh/traced_asset.h"
#include "farfield/ray.h"

namespace farfield {

/// A number in [0, 1) for where the ray (in local space) is at its tfar: the same for all rays of a path in a cube with
/// sides of `cell`, so that camera and shadow rays, and a wall's front and back, agree. salt: for numbers that have
/// nothing to do with each other.
float path_number(const RayContext& context, const EmbreeRay& ray, float cell, uint64_t salt);
/// A number in [0, 1) for a ray at a face.
float ray_number(const RayContext& context, const EmbreeRay& ray, uint32_t face);

/// The side of the cubes in which a path sees gaps alike, in resolutions.
inline constexpr float kGapCell = 4;

/// The share of a face that is gaps between the pieces it stands for, along a ray that hits it.
float gap_along(const LevelView& level, uint32_t face, const EmbreeRay& ray, const EmbreeHit& hit);
/// The share of rays that the rest of a face stops at a hit.
float opacity_at(const TracedLevel& level, const RayContext& context, const EmbreeRay& ray, uint32_t quad,
                 uint32_t face, const vec2& barycentric);

/// Whether a level stops every ray that meets a face.
inline bool is_opaque(const LevelView& level) { return level.face_opacity.empty() && level.face_gap.empty(); }

/// Embree asks it about every hit on a level (`args->geometryUserPtr`, a TracedLevel) whose faces are not all opaque
/// and whole. For single rays: InstanceGeometry takes packets apart.
void opacity_filter(const EmbreeFilterArguments* args);

}  // namespace farfield
