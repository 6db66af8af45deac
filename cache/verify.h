// SPDX-License-Identifier: Apache-2.0
// Verification of a whole baked asset: every byte of every file, and the manifest's figures against the files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "cache/level.h"

namespace farfield {

/// One thing that verify_asset() found.
struct Finding {
  enum class Severity {
    Error,    ///< the asset is not what its bake wrote; do not use it
    Warning,  ///< does no harm to rendering: a file that does not belong, a broken rule of thumb
  };
  Severity severity = Severity::Error;
  std::string file;     ///< name inside the folder; empty: the folder itself
  std::string message;  ///< one line, naming the file and what to do
};

struct VerifyResult {
  std::vector<Finding> findings;  ///< manifest first, then levels from fine to coarse, then the folder
  uint64_t levels_checked = 0;    ///< that could be opened
  uint64_t bytes_checked = 0;
  /// No errors; warnings do not count.
  bool is_sound() const;
};

/// What takes how much once loaded, measured. Errors: what went wrong.
struct CostMeasures {
  std::function<Result<LevelCost>(const LevelView& level)> level;
  /// The morph between two neighbouring stored levels, beside them.
  std::function<Result<LevelCost>(const LevelView& fine, const LevelView& coarse)> morph;
};

/// Reads the whole folder. Never fails: whatever goes wrong is a finding. What levels and morphs take is held against
/// the manifest, where there is a measure: less than two thirds of it there is an error, any other difference a
/// warning, as BVHs differ between processors. Any thread; nobody may write meanwhile.
VerifyResult verify_asset(const std::filesystem::path& asset_dir, const CostMeasures& measure = {});

}  // namespace farfield
