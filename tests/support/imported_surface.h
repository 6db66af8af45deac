// SPDX-License-Identifier: Apache-2.0
// A file as the surface of one material per face that coarser levels are made of, with faces split nowhere.
#pragma once

#include <filesystem>
#include <limits>
#include <utility>

#include "base/result.h"
#include "prefilter/condition.h"
#include "prefilter/resolve.h"

namespace farfield::test {

struct ImportedSurface : ImportedAsset {
  Surface surface;
};

inline Result<ImportedSurface> import_surface(const std::filesystem::path& path, const ImportOptions& options = {},
                                              const Job& job = {}) {
  FARFIELD_TRY_LET(auto asset, import_asset(path, options));
  auto resolved = resolve(asset.source, std::numeric_limits<float>::max(), job);
  if (!resolved) {
    return make_error(resolved.error().code, path.string() + ": " + resolved.error().message);
  }
  return ImportedSurface{std::move(asset), std::move(resolved->surface)};
}

}  // namespace farfield::test
