// SPDX-License-Identifier: Apache-2.0
// Where the lattice of a level's volume lies, to the fraction of a voxel (docs/decisions/0015).
#pragma once

#include "base/vec.h"
#include "prefilter/surface.h"
#include "prefilter/voxel_marks.h"

namespace farfield {

/// The lattice whose voxels have the geometry in their middles, as far as all of it can be: a trunk, a mast or a deck
/// fills one voxel across, not two in part, and stays where it is. The origin is within half a voxel of `middle` along
/// each axis, in the space of geometry.positions. Geometry without area: `middle` is the centre of a voxel.
VoxelLattice place_lattice(const Surface& geometry, const dvec3& middle, double voxel_size);

}  // namespace farfield
