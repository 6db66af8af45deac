// SPDX-License-Identifier: Apache-2.0
// A parsed glTF file whose every index can be followed without looking: tinygltf reads the JSON, this file checks it.
// Internal to the room; only the glTF readers include it.
#pragma once

#include <tiny_gltf.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include "base/hash.h"
#include "base/result.h"
#include "base/vec.h"
#include "import/gltf_buffer_files.h"

namespace farfield {

/// One thread at a time: buffers are read when something in them is asked for.
struct GltfDocument {
  std::string name;       ///< the file's path, for messages
  tinygltf::Model model;  ///< without the bytes of buffer_files
  std::vector<std::string> warnings;
  std::vector<HashedFile> files;  ///< the images in files of their own, and the buffers of a .glb that are
  std::unique_ptr<GltfBufferFiles> buffer_files;  ///< of a .gltf; not null

  /// Errors: those of GltfBufferFiles::bytes().
  Result<std::span<const unsigned char>> buffer_bytes(size_t buffer) const;
  /// All files but the glTF file itself that were read so far.
  std::vector<HashedFile> files_read() const;
  tl::unexpected<Error> bad(const std::string& what) const;
};

/// Parses `bytes` (.glb or .gltf) and checks: JSON depth, required extensions, node tree indices and cycles, mesh,
/// material, texture, image, camera and skin indices. Accessors are checked when they are read. Images stay encoded.
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

/// -1 (absent) or a valid index.
template <typename T>
bool is_index(int index, const std::vector<T>& of) {
  return index >= -1 && index < static_cast<int>(of.size());
}

/// A number of an extension object, if it is there and finite.
std::optional<double> extension_number(const tinygltf::Value& object, const char* key);
/// An array of three numbers of an extension object, if it is there.
std::optional<vec3> extension_vec3(const tinygltf::Value& object, const char* key);

}  // namespace farfield
