// SPDX-License-Identifier: Apache-2.0
// The images that OBJ + MTL and PLY files name: each read once, noted as part of the source.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "import/source_mesh.h"

namespace farfield {

/// One thread at a time. `mesh` takes warnings and source_files; paths in those are relative to `folder`.
class ImageFiles {
 public:
  ImageFiles(std::filesystem::path folder, SourceMesh& mesh) : folder_(std::move(folder)), mesh_(mesh) {}

  /// The bytes of a file that is part of the source, whether it is there or not. Errors: those of read_file().
  Result<std::vector<unsigned char>> read_noted(const std::filesystem::path& path);

  /// The image that a file in `folder` names; null, with a warning, when it cannot be had: the plain colour then
  /// stands alone. A path of another computer is looked for by its last part.
  std::shared_ptr<const Texture> read(const std::filesystem::path& folder, std::string_view name, TextureUse use);

  /// The heights in a channel (as MtlMap has it) of the image that a file in `folder` names; null, with a warning, when
  /// they cannot be had. Values that are not finite are a warning, too.
  std::shared_ptr<const HeightMap> read_heights(const std::filesystem::path& folder, std::string_view name,
                                                char channel);

  /// An error once an image was wanted and none can be read: no fault of the file, so no case for plain colours.
  const Result<void>& ready() const { return ready_; }

 private:
  struct Found {
    std::filesystem::path path;
    Result<std::vector<unsigned char>> bytes;
  };

  Found find(const std::filesystem::path& folder, const std::filesystem::path& named);
  /// Says why an image is not there; `instead` is what becomes of it.
  void miss(const Error& error, const char* instead);

  std::filesystem::path folder_;
  SourceMesh& mesh_;
  std::map<std::pair<std::string, TextureUse>, std::shared_ptr<const Texture>> images_;
  std::map<std::pair<std::string, char>, std::shared_ptr<const HeightMap>> heights_;
  Result<void> ready_;
};

/// A file name as exporters on Windows write it, with the slashes of this system.
std::string with_slashes(std::string_view name);

/// Where a file that is not at `named` may be meant: `folder` has its last part, as paths of other computers do, or its
/// name in other letters, which is the same file on Windows and Macs. Empty if nowhere.
std::filesystem::path find_by_last_name(const std::filesystem::path& folder, const std::filesystem::path& named);

}  // namespace farfield
