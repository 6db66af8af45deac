// SPDX-License-Identifier: Apache-2.0
// A parsed glTF file whose every index can be followed without looking: tinygltf reads the JSON, this file checks it.
// Internal to the room; only the glTF readers include it.
#pragma once

#include <tiny_gltf.h>

#include <filesystem>
#include <optional>
#include <span>

#include "base/hash.h"
#include "base/result.h"
#include "base/vec.h"

namespace farfield {

struct GltfDocument {
  std::string name;  ///< the file's path, for messages
  tinygltf::Model model;
  std::vector<std::string> warnings;
  std::vector<HashedFile> files;  ///< the buffers and images in files of their own

  tl::unexpected<Error> bad(const std::string& what) const;
};

/// Parses `bytes` (.glb or .gltf) and checks: JSON depth, required extensions, node tree indices and cycles, mesh,
/// material, texture, image and camera indices. Accessors are checked when they are read. Images stay encoded.
Result<GltfDocument> open_gltf(std::span<const unsigned char> bytes, const std::filesystem::path& path);

/// The values of an accessor as doubles, `components` per element (normalized integers become [0, 1] or [-1, 1]; sparse
/// values are put in). Errors: BadFile when it has another number of components or reaches past its buffer.
Result<std::vector<double>> read_accessor(const GltfDocument& document, int index, int components);

/// An index accessor: unsigned integers only. Values are not checked against anything.
Result<std::vector<uint32_t>> read_indices(const GltfDocument& document, int index);

/// The encoded bytes of an image, wherever they are. Errors: BadFile, NotFound.
Result<std::vector<unsigned char>> image_bytes(const GltfDocument& document, int image);

/// The index of a texture's image, the one of EXT_texture_webp where there is one; -1: none.
int image_of(const tinygltf::Texture& texture);

/// How many components the elements of an accessor have (VEC3: 3). The index must be valid.
int component_count(const GltfDocument& document, int accessor);

/// The nodes of the default scene in depth-first order, parents first. Without a scene: all nodes that are no children.
std::vector<int> scene_nodes(const GltfDocument& document);

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

/// Whether all entries are finite and the volume that the unit cube becomes is not zero.
bool is_invertible(const glm::dmat4& matrix);

/// A number of an extension object, if it is there and finite.
std::optional<double> extension_number(const tinygltf::Value& object, const char* key);
/// An array of three numbers of an extension object, if it is there.
std::optional<vec3> extension_vec3(const tinygltf::Value& object, const char* key);

}  // namespace farfield
