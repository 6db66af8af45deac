// SPDX-License-Identifier: Apache-2.0
// The nodes of a glTF file: their order, what they show, and where it stands. Internal to the room.
#pragma once

#include <optional>
#include <vector>

#include "base/result.h"
#include "base/vec.h"
#include "farfield/instance_data.h"
#include "import/gltf_document.h"

namespace farfield {

inline constexpr const char* kInstancingExtension = "EXT_mesh_gpu_instancing";

/// The nodes of the default scene in depth-first order, parents first. Without a scene: all nodes that are no children.
std::vector<int> scene_nodes(const GltfDocument& document);

/// A node and all below it, parents first.
std::vector<int> nodes_below(const tinygltf::Model& model, int root);

/// For each node its parent, or -1.
std::vector<int> parents(const tinygltf::Model& model);

/// A node's own transform at rest.
struct NodeTransform {
  dvec3 translation{0.0}, scale{1.0};
  glm::dvec4 rotation{0, 0, 0, 1};  ///< unit quaternion xyzw; zero or NaN ones in the file become the identity
  glm::dmat4 matrix{1.0};
  bool has_matrix = false;
};
NodeTransform transform_of(const tinygltf::Node& node);
glm::dmat4 to_matrix(const NodeTransform& transform);

/// Where a node shows its mesh, in the node's own space: once at its origin, or as EXT_mesh_gpu_instancing says.
/// Errors: BadFile (no such accessor, attributes of different lengths).
Result<std::vector<glm::dmat4>> instance_transforms(const GltfDocument& document, const tinygltf::Node& node);

/// What the file says for the host of each of a node's `count` instances: the attributes _ID and _TINT of
/// EXT_mesh_gpu_instancing, else "farfield_id" and "farfield_tint" of the node's extras, else the default. Errors:
/// BadFile (no such accessor, another length, ids that are no whole numbers from 0, tints that are not finite).
Result<std::vector<InstanceData>> instance_data(const GltfDocument& document, const tinygltf::Node& node, size_t count);

/// What a node's extras say of all its instances, "farfield_id" and "farfield_tint", or the default.
InstanceData data_of_extras(const tinygltf::Node& node);

/// For each node whether KHR_node_visibility hides it, itself or by a node above it.
std::vector<bool> hidden_nodes(const GltfDocument& document);

/// Where a skinned mesh stands, stiff: with the joint that its skin names first. In the bind pose all joints say the
/// same, and glTF ignores the transform of the node itself (glTF 2.0, 3.7.3.3).
struct SkinPlace {
  int joint = 0;  ///< a node
  glm::dmat4 in_joint{1.0};
};
/// The node must have a skin. Nothing if what stands as its bind matrix is no invertible transform: some files have
/// random bytes there. Errors: BadFile (matrices that are not in the file).
Result<std::optional<SkinPlace>> skin_place(const GltfDocument& document, const tinygltf::Node& node);

/// Whether a node asks for other morph weights than its mesh; those of the mesh are shown.
bool has_weights_of_its_own(const GltfDocument& document, const tinygltf::Node& node);

/// What is said of nodes, the same whoever reads them.
inline constexpr const char* kSkinned = "skinned; shown stiff, in its bind pose where its first joint is";
inline constexpr const char* kBrokenSkin = "skinned, but its bind matrix is no transform; shown where the node is";
inline constexpr const char* kOwnWeights = "its own morph weights are ignored; its mesh's are shown";

/// Whether all entries are finite and the volume that the unit cube becomes is not zero.
bool is_invertible(const glm::dmat4& matrix);

}  // namespace farfield
