// SPDX-License-Identifier: Apache-2.0
// What a host hands to the bake, as if a file had been read.
#pragma once

#include "base/job.h"
#include "base/result.h"
#include "farfield/bake.h"
#include "import/source_mesh.h"

namespace farfield {

/// The input checked and copied, images read, with a source_hash of all that it says (of material_function:
/// material_key). Errors: those of gather_mesh and gather_materials.
Result<SourceMesh> source_from_input(const BakeInput& input, const Job& job = {});

}  // namespace farfield
