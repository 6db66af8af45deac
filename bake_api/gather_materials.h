// SPDX-License-Identifier: Apache-2.0
// A host's materials, checked, with their images read.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "farfield/bake.h"
#include "import/source_mesh.h"

namespace farfield {

struct GatheredMaterials {
  std::vector<SourceMaterial> materials;
  std::vector<SourceHeights> heights;  ///< empty, or one per material
  std::vector<std::string> warnings;
};

/// One for each of input.materials, and further ones of the default kind up to `count`. A file that several materials
/// name is read once. Heights of files that are not finite are mended, with a warning. Errors: InvalidArgument (numbers
/// out of range, by material and field), those of read_texture.
Result<GatheredMaterials> gather_materials(const BakeInput& input, size_t count);

}  // namespace farfield
