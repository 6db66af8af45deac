// SPDX-License-Identifier: Apache-2.0
// The buffers that a glTF file has in files of their own: of a scene of many assets each reader needs a few. Internal
// to the room.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/free_memory.h"
#include "base/hash.h"
#include "base/result.h"

namespace farfield {

/// One thread at a time.
class GltfBufferFiles {
 public:
  GltfBufferFiles() = default;
  /// Finds them in the JSON of the file at `gltf`, and leaves an embedded buffer of one byte in the place of each.
  /// Errors: NotFound (no such file in the folder of `gltf` or relative to it).
  static Result<GltfBufferFiles> take_from(nlohmann::json& json, const std::filesystem::path& gltf);

  /// Where in the folder of the glTF file a URI means a file: "a%20b" is "a b".
  static std::filesystem::path path_of_uri(const std::string& uri);

  bool empty() const { return buffers_.empty(); }
  bool has(size_t buffer) const { return buffers_.contains(buffer); }
  /// As the glTF file promises them, of all.
  uint64_t total_bytes() const;

  /// The bytes of a buffer that it has, read when they are first asked for, and kept. Errors: those of read_file(),
  /// BadFile (another size than promised).
  Result<std::span<const unsigned char>> bytes(size_t buffer);
  /// Drops what bytes() has read.
  void forget(size_t buffer) { free_memory(buffers_.at(buffer).bytes); }

  /// Those that were read, relative to the folder of the glTF file, in the order in which they were.
  const std::vector<HashedFile>& files_read() const { return files_read_; }

 private:
  struct Buffer {
    std::filesystem::path path;
    std::filesystem::path in_folder;  ///< the same from the folder of the glTF file
    uint64_t promised_bytes = 0;
    std::vector<unsigned char> bytes;  ///< empty: not read yet
  };
  std::map<size_t, Buffer> buffers_;  ///< by number
  std::vector<HashedFile> files_read_;
};

}  // namespace farfield
