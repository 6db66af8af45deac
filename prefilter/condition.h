// SPDX-License-Identifier: Apache-2.0
// Surface conditioning: what a file says becomes clean triangles, which still look just as the source does.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/job.h"
#include "base/result.h"
#include "import/read_source.h"
#include "prefilter/source_surface.h"

namespace farfield {

/// Goes up when condition() or what the bake makes of its result gives other results.
inline constexpr uint32_t kConditionVersion = 5;

struct ImportedAsset {
  SourceSurface source;
  uint64_t source_hash = 0;              ///< of the file's bytes, of the files it refers to, and of ImportOptions
  std::vector<HashedFile> source_files;  ///< that it refers to, relative to its folder
  std::vector<std::string> warnings;     ///< one line each: dropped faces, missing textures, ignored features
};

/// Polygons are triangulated (quads along the diagonal that lies inside, the shorter of two; concave ones correctly),
/// vertices that share a position up to rounding are welded, triangles that coincide are kept once, degenerate and NaN
/// faces are dropped with a warning. What lies at corners stays there: nothing is averaged. `name` is for messages.
/// Errors: BadFile (no face with area is left), Unsupported (a longest side outside [1e-6, 1e9], which single precision
/// cannot work in), Cancelled; with the mesh's warnings.
Result<ImportedAsset> condition(SourceMesh mesh, const std::string& name, const Job& job = {});

/// The mesh that tiles were last cut from, so that its many tiles read it once. Files are taken not to change
/// meanwhile. One thread at a time.
class KnownMesh {
 public:
  /// The whole mesh, whatever tile the options want. Valid until the next call. Errors: those of import_asset().
  Result<const ImportedAsset*> import(const std::filesystem::path& path, const ImportOptions& options, const Job& job);
  /// Gives its memory back.
  void forget() { mesh_.reset(); }

 private:
  std::string name_;  ///< what it is, as import_asset() was asked for it
  std::optional<ImportedAsset> mesh_;
};

/// read_source(), which hears no cancel, subdivide() and condition(), then cut_tile(). The first tile of a mesh has the
/// warnings of all. Errors: those of all three; BadFile (fewer faces than tiles).
Result<ImportedAsset> import_asset(const std::filesystem::path& path, const ImportOptions& options = {},
                                   const Job& job = {});

}  // namespace farfield
