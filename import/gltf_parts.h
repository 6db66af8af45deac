// SPDX-License-Identifier: Apache-2.0
// What an asset takes from a glTF file, as a hash: another camera, other instances or another mesh beside it do not
// make it another asset. Internal to the room.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <vector>

#include "import/gltf_buffer_files.h"

namespace farfield {

/// The JSON of a file and the hashes of its buffer views; no bytes are kept. One thread at a time.
class GltfParts {
 public:
  /// Nothing if the (unpacked) bytes are no glTF, or its buffers are not there. path: for finding other files.
  static std::optional<GltfParts> open(std::span<const unsigned char> bytes, const std::filesystem::path& path);

  /// Of all that read_gltf() depends on for this mesh, or this node and those below it. Each buffer is read once for
  /// all parts. Nothing if what is referred to is broken, or cannot be told from the rest (skins).
  std::optional<uint64_t> hash(int mesh, int node);

 private:
  using Json = nlohmann::json;
  GltfParts() = default;

  // Each mixes what it is called for into hash_; what cannot be followed clears is_clear_.
  void add(const Json& values);
  void add_mesh(const Json& index);
  void add_primitive(Json primitive);
  void add_accessor(const Json& index);
  void add_view(const Json& index);
  void add_material(const Json& index);
  void add_textures_in(const Json& values);
  void add_texture(const Json& index);
  void add_image(const Json& index);
  void add_nodes(int root);
  void add_node(Json node, bool is_root);
  void add_visibility_above(int node);

  const Json* element(const char* list, const Json& index);
  void hash_views_of(size_t buffer);
  void hash_views_of(size_t buffer, std::span<const unsigned char> bytes);

  Json json_;
  std::filesystem::path folder_;
  GltfBufferFiles files_;
  std::map<size_t, std::vector<size_t>> views_of_;      ///< per buffer
  std::vector<std::optional<uint64_t>> bytes_of_view_;  ///< hashes
  std::map<int, int> parent_of_;                        ///< nodes
  uint64_t hash_ = 0;                                   ///< of the part at hand
  bool is_clear_ = true;                                ///< whether hash_ is of all that the part needs
};

}  // namespace farfield
