// SPDX-License-Identifier: Apache-2.0
// A host's materials, checked, with their images read.
#pragma once

#include <vector>

#include "base/result.h"
#include "farfield/bake.h"
#include "import/source_mesh.h"

namespace farfield {

/// One for each of input.materials, and further ones of the default kind up to `count`. A file that several materials
/// name is read once. Errors: InvalidArgument (numbers out of range, by material and field), those of read_texture.
Result<std::vector<SourceMaterial>> gather_materials(const BakeInput& input, size_t count);

}  // namespace farfield
