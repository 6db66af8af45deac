// SPDX-License-Identifier: Apache-2.0
// A host's arrays, checked and copied into the one mesh that the bake takes.
#pragma once

#include "base/job.h"
#include "base/result.h"
#include "farfield/bake.h"
#include "import/source_mesh.h"

namespace farfield {

/// Material ids lie below this: there is one SourceMaterial for each.
inline constexpr uint32_t kMaxMaterials = 1u << 16;

inline bool has_material_function(const BakeInput& input) {
  return input.material_function || input.material_batch_function;
}

/// All instances of all meshes. `materials` of the result is left empty. Errors: InvalidArgument, naming mesh and
/// element (farfield/bake.h has the rules); Unsupported (more than 2^32 - 1 corners), Cancelled.
Result<SourceMesh> gather_mesh(const BakeInput& input, const Job& job = {});

}  // namespace farfield
