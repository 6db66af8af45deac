// SPDX-License-Identifier: Apache-2.0
// What extras of a glTF file say of meshes: docs/scene_format.md, "Subdivision". Internal to the room.
#pragma once

#include <tiny_gltf.h>

#include <optional>
#include <string>

#include "base/result.h"
#include "import/subdivision_options.h"

namespace farfield {

/// "farfield_subdivision" of a mesh, by the names that --subdivide has; nothing if it says nothing. Errors: BadFile,
/// one line without the mesh.
Result<std::optional<SubdivisionScheme>> scheme_of_extras(const tinygltf::Mesh& mesh);

struct NamedMesh {
  std::string file;  ///< OBJ or PLY, relative to the folder of the glTF file
  std::optional<SubdivisionScheme> scheme;
};

/// "farfield_mesh" of a node; nothing if it says nothing. Errors: BadFile, one line without the node.
Result<std::optional<NamedMesh>> mesh_of_extras(const tinygltf::Node& node);

}  // namespace farfield
