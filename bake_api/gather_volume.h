// SPDX-License-Identifier: Apache-2.0
// A host's voxels as if a volume file had been read.
#pragma once

#include "base/job.h"
#include "base/result.h"
#include "farfield/bake.h"
#include "import/fog_options.h"
#include "import/source_volume.h"

namespace farfield {

/// The same as the import has it.
FogOptions fog_options(const BakeFog& fog);

/// The volume checked and copied, cut to the voxels that have a density, with a source_hash of all that it says.
/// Errors: InvalidArgument (sizes, the transform, numbers: with the voxel; nothing with a density; options, or options
/// that are of files alone), Unsupported (more voxels than a level can hold), Cancelled.
Result<SourceVolume> gather_volume(const BakeVolume& volume, const BakeFog& fog, const Job& job = {});

}  // namespace farfield
