// SPDX-License-Identifier: Apache-2.0
// Which nodes of a scene are one asset together with all below them (a tree: bark, twigs, leaves), and which meshes are
// equal. Internal to the room.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/vec.h"
#include "import/gltf_document.h"
#include "import/gltf_scene.h"

namespace farfield {

/// For each mesh the first one of the file that is equal to it: same primitives, materials, weights and bytes, whatever
/// they are called. Bytes are read only of meshes that look equal without.
std::vector<uint32_t> first_equal_meshes(const GltfDocument& document);

/// A kind of subtree that is an asset.
struct Assembly {
  int node = 0;                 ///< of the file: the root of the first subtree of this kind
  Box3 bounds;                  ///< of all its parts, in the space of that node
  uint64_t triangle_count = 0;  ///< of all its parts
};

struct Assemblies {
  std::vector<Assembly> kinds;
  std::vector<int> kind_of;           ///< per node of the file: what it is the root of, or -1
  std::vector<bool> is_part;          ///< per node of the file: shown by an assembly, at it or above it
  std::vector<std::string> warnings;  ///< marks that cannot be followed
};

/// The rule is that of docs/scene_format.md, "What becomes one asset". order: scene_nodes(document). meshes: of the
/// file, measured. Errors: those of instance_transforms().
Result<Assemblies> find_assemblies(const GltfDocument& document, std::span<const int> order,
                                   std::span<const GltfMesh> meshes, std::span<const uint32_t> first_equal_mesh,
                                   AssemblyRule rule);

}  // namespace farfield
